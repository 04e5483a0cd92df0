#include "server/runtime/thread_pool.hpp"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace parhelion::runtime {

struct ThreadPool::State {
  std::mutex mutex;
  std::condition_variable called, finished;
  const std::function<void(int, int)>* job = nullptr;
  int next = 0, jobs = 0, working = 0;  ///< working: own threads with a job
  bool leave = false;
  std::exception_ptr fault;
  std::vector<std::thread> threads;

  /// Runs jobs until none is left. The lock is held at entry and return.
  void work(int worker, std::unique_lock<std::mutex>& lock) {
    while (next < jobs) {
      const int mine = next++;
      lock.unlock();
      std::exception_ptr thrown;
      try {
        (*job)(mine, worker);
      } catch (...) {
        thrown = std::current_exception();
      }
      lock.lock();
      if (thrown && !fault) fault = thrown;
    }
  }

  void serve(int worker) {
    std::unique_lock lock(mutex);
    for (;;) {
      called.wait(lock, [this] { return leave || next < jobs; });
      if (leave) return;
      ++working;
      work(worker, lock);
      if (--working == 0) finished.notify_one();
    }
  }
};

ThreadPool::ThreadPool(int size) : state_(std::make_unique<State>()) {
  for (int worker = 1; worker < size; ++worker)
    state_->threads.emplace_back([this, worker] { state_->serve(worker); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->leave = true;
  }
  state_->called.notify_all();
  for (std::thread& thread : state_->threads) thread.join();
}

int ThreadPool::size() const { return static_cast<int>(state_->threads.size()) + 1; }

void ThreadPool::run(int jobs, const std::function<void(int, int)>& job) {
  if (state_->threads.empty() || jobs <= 1) {
    for (int i = 0; i < jobs; ++i) job(i, 0);
    return;
  }
  std::unique_lock lock(state_->mutex);
  state_->job = &job;
  state_->next = 0;
  state_->jobs = jobs;
  const int others = std::min(jobs, size()) - 1;
  for (int i = 0; i < others; ++i) state_->called.notify_one();
  state_->work(0, lock);
  state_->finished.wait(lock, [this] { return state_->working == 0; });
  state_->jobs = state_->next = 0;
  if (state_->fault) std::rethrow_exception(std::exchange(state_->fault, nullptr));
}

}  // namespace parhelion::runtime

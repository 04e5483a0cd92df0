#include "server/station/http/slow_work.hpp"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace parhelion::station {

SlowWork::SlowWork(std::size_t max_waiting) : max_waiting_(max_waiting), thread_([this] { work(); }) {}

SlowWork::~SlowWork() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool SlowWork::take(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    if (tasks_.size() >= max_waiting_) return false;
    tasks_.push_back(std::move(task));
  }
  changed_.notify_all();
  return true;
}

void SlowWork::work() {
  // On Linux, niceness is a property of a thread.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), 10);
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !tasks_.empty(); });
    if (ending_) return;
    auto task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    task = nullptr;
    lock.lock();
  }
}

}  // namespace parhelion::station

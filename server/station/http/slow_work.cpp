#include "server/station/http/slow_work.hpp"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>

namespace parhelion::station {

SlowWork::SlowWork(SlowWorkLimits limits) : limits_(limits), thread_([this] { work(); }) {}

SlowWork::~SlowWork() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool SlowWork::take(const std::string& client, std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_ >= limits_.waiting) return false;
    auto line = std::find_if(lines_.begin(), lines_.end(), [&](const Line& l) { return l.client == client; });
    if (line == lines_.end()) line = lines_.insert(lines_.end(), Line{client, {}});
    if (line->tasks.size() >= limits_.waiting_per_client) return false;
    line->tasks.push_back(std::move(task));
    ++waiting_;
  }
  changed_.notify_all();
  return true;
}

std::function<void()> SlowWork::next() {
  Line& line = lines_.front();
  auto task = std::move(line.tasks.front());
  line.tasks.pop_front();
  --waiting_;
  if (line.tasks.empty()) {
    lines_.pop_front();
  } else {
    lines_.splice(lines_.end(), lines_, lines_.begin());
  }
  return task;
}

void SlowWork::work() {
  // On Linux, niceness is a property of a thread.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), 10);
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !lines_.empty(); });
    if (ending_) return;
    auto task = next();
    lock.unlock();
    task();
    task = nullptr;
    lock.lock();
  }
}

}  // namespace parhelion::station

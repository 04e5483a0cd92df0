// A worker thread for slow tasks: hashing passwords, writing accounts.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace parhelion::station {

/// Runs tasks one after the other, at low priority.
class SlowWork {
 public:
  explicit SlowWork(std::size_t max_waiting);
  /// Drops waiting tasks and waits for the running one.
  ~SlowWork();

  /// False: too many tasks wait, and this one was rejected. Thread-safe.
  bool take(std::function<void()> task);

 private:
  void work();

  const std::size_t max_waiting_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace parhelion::station

// A thread for what would hold up the server's: hashing passwords, writing accounts.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace parhelion::station {

/// Tasks one after the other, at a low priority.
class SlowWork {
 public:
  explicit SlowWork(std::size_t most_waiting);
  /// What waits is dropped; what runs is waited for.
  ~SlowWork();

  /// false: too many wait already, and the task was not taken. Thread-safe.
  bool take(std::function<void()> task);

 private:
  void work();

  const std::size_t most_waiting_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace parhelion::station

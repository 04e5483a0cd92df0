// A worker thread for slow tasks: hashing passwords, writing accounts.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>

namespace parhelion::station {

struct SlowWorkLimits {
  std::size_t waiting = 256;            ///< tasks of all clients
  std::size_t waiting_per_client = 32;  ///< a class that logs in at the same moment from one address
};

/// Runs tasks one after the other, at low priority: one of each client in turn, so that one with many tasks
/// does not delay the others.
class SlowWork {
 public:
  explicit SlowWork(SlowWorkLimits limits = {});
  /// Drops waiting tasks and waits for the running one.
  ~SlowWork();

  /// False: too many tasks wait, and this one was rejected. Thread-safe.
  bool take(const std::string& client, std::function<void()> task);

 private:
  struct Line {
    std::string client;
    std::deque<std::function<void()>> tasks;
  };
  std::function<void()> next();
  void work();

  const SlowWorkLimits limits_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Line> lines_;  ///< none is empty; the first is the next to be served
  std::size_t waiting_ = 0;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace parhelion::station

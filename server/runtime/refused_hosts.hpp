// Machines whose datagrams the bus refused.
#pragma once

#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace parhelion::runtime {

/// From a thread of the bus to the loop. Thread-safe.
class RefusedHosts {
 public:
  void add(const std::string& address) {
    const std::lock_guard lock(mutex_);
    news_.push_back(address);
  }
  /// Those added since the last call.
  std::vector<std::string> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(news_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> news_;
};

}  // namespace parhelion::runtime

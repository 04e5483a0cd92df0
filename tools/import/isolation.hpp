// A library that can't be trusted with damaged input runs in a child process first.
#pragma once

#include <sys/resource.h>

#include <cstdint>
#include <functional>
#include <optional>

#include "protocols/status.hpp"

namespace parhelion::tools {

/// While it lives, this process gets at most `headroom` bytes more than it has: a count that lies makes a
/// request for memory fail instead of taking the machine's.
class AllocationLimit {
 public:
  explicit AllocationLimit(std::uint64_t headroom);
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
  ~AllocationLimit();

 private:
  rlimit before_{};
  bool active_ = false;
};

struct ChildEnd {
  bool completed = false;             ///< false: it crashed
  std::optional<std::uint64_t> last;  ///< what it reported last
};

/// Runs `work` in a child process, silent; `work` calls its argument to report where it is. Error: no process
/// to be had.
Result<ChildEnd> run_in_child(const std::function<void(const std::function<void(std::uint64_t)>&)>& work);

}  // namespace parhelion::tools

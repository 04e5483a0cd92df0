// Runs work that may crash on damaged input or fill the memory in a child process. Call these functions from
// one thread: a process that others are forked from should have no other that holds a lock.
#pragma once

#include <sys/resource.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "protocols/status.hpp"

namespace parhelion {

/// While it lives, this process can allocate at most `headroom` bytes more than it has, so that a corrupt
/// count makes an allocation fail instead of exhausting the machine. Does nothing under AddressSanitizer,
/// whose shadow memory takes terabytes of addresses.
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

struct ChildLimits {
  std::uint64_t bytes = 0;    ///< that the child may allocate
  std::uint64_t seconds = 0;  ///< of processor time
};

struct ChildEnd {
  bool completed = false;             ///< false: it crashed, or reached a limit
  bool out_of_time = false;           ///< it used all its processor time
  bool out_of_memory = false;         ///< an allocation failed
  int signal = 0;                     ///< that ended it; 0: none
  double seconds = 0;                 ///< of processor time that it used
  std::optional<std::uint64_t> last;  ///< its last report
};

/// Runs `work` in a child process without output; `work` calls its argument to report its position, any
/// number but the greatest. Error: no process could be created.
Result<ChildEnd> run_in_child(const ChildLimits& limits,
                              const std::function<void(const std::function<void(std::uint64_t)>&)>& work);

struct ChildResult {
  ChildEnd end;
  std::string bytes;  ///< what `work` returned; empty unless completed
};

using WorkOfChild = std::function<std::string(const std::function<void(std::uint64_t)>&)>;

/// The same for work that returns bytes. `on_report` gets each report; it may be empty.
Result<ChildResult> result_of_child(const ChildLimits& limits, const WorkOfChild& work,
                                    const std::function<void(std::uint64_t)>& on_report = {});

struct ChildTask {
  ChildLimits limits;
  WorkOfChild work;
};

/// The results of task(0) to task(count - 1), each in a child process of its own, at most `at_once` at a
/// time. on_result(index, result) is called in the order in which they end.
void results_of_children(std::size_t count, std::size_t at_once,
                         const std::function<ChildTask(std::size_t)>& task,
                         const std::function<void(std::size_t, Result<ChildResult>)>& on_result);

/// Why it did not complete, for people: "needs more than 1024 MB", "crashed (Segmentation fault)".
std::string describe(const ChildEnd& end, const ChildLimits& limits);

}  // namespace parhelion

// Memory that a process may still allocate on this machine.
#pragma once

#include <cstdint>

namespace parhelion {

/// Bytes: the kernel's estimate (MemAvailable), or the limit of the control group or the process (ulimit -v)
/// where that is smaller; the largest number where neither can be read.
std::uint64_t available_memory();

}  // namespace parhelion

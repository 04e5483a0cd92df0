// Memory that a process may still allocate on this machine.
#pragma once

#include <cstdint>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::cloud {

/// Bytes: the kernel's estimate (MemAvailable), or the limit of the control group or the process (ulimit -v)
/// where that is smaller; the largest number where neither can be read.
std::uint64_t available_memory();

/// Error where `bytes` exceeds `available` (0: use available_memory()); it names both numbers and `what`.
Status require_memory(std::uint64_t bytes, std::uint64_t available, const std::string& what);

}  // namespace parhelion::cloud

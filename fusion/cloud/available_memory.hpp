// How much memory a process may still take on this machine.
#pragma once

#include <cstdint>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::cloud {

/// Bytes: the kernel's estimate (MemAvailable), or what the control group or a limit of the
/// process (ulimit -v) leaves where that is less; the
/// largest number where neither can be read.
std::uint64_t available_memory();

/// Error where `bytes` are more than `available` (0: ask the machine): says both, and `what` needs them.
Status require_memory(std::uint64_t bytes, std::uint64_t available, const std::string& what);

}  // namespace parhelion::cloud

// Lines of `serve` on standard error, which is the journal of a service.
#pragma once

#include <cstdint>
#include <string>

namespace parhelion::tools {

/// As in syslog(3).
enum class Priority : std::uint8_t { error = 3, warning = 4, information = 6 };

/// Writes "parhelion serve: <text>" to standard error, with the priority as sd-daemon(3) has it if that is
/// the journal: elsewhere people read it.
void log_line(Priority priority, const std::string& text);

}  // namespace parhelion::tools

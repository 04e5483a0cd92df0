// Text output of `topic echo` for a message.
#pragma once

#include <string>

#include "protocols/bus/bus.hpp"

namespace parhelion::tools {

/// One line; below it, indented, the YAML of a robot description or a session header. Contains no terminal
/// control characters.
std::string echo_text(const Message& message);

/// `text` with '?' in place of control characters; line ends are kept if `lines`.
std::string printable(std::string text, bool lines = false);

}  // namespace parhelion::tools

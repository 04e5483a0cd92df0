// What `topic echo` prints for a message.
#pragma once

#include <string>

#include "protocols/bus/bus.hpp"

namespace parhelion::tools {

/// One line; below it, indented, the YAML that a robot description or a session header carries. Nothing in it
/// that a terminal would obey.
std::string echo_text(const Message& message);

/// `text` with '?' for what a terminal would obey; line ends stay where `lines`.
std::string printable(std::string text, bool lines = false);

}  // namespace parhelion::tools

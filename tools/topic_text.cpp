#include "tools/topic_text.hpp"

#include <sstream>

#include "protocols/codec.hpp"

namespace parhelion::tools {
namespace {

std::string indented(const char* title, const std::string& yaml) {
  std::string out = std::string("\n  ") + title + ":";
  std::istringstream lines(printable(yaml, true));
  for (std::string line; std::getline(lines, line);) out += "\n    " + line;
  return out;
}

}  // namespace

std::string printable(std::string text, bool lines) {
  unsigned char before = 0;
  for (char& c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool second_controls = before == 0xC2 && byte < 0xA0;  // U+0080 to U+009F
    if (((byte < 0x20 || byte == 0x7f) && !(lines && c == '\n')) || second_controls) c = '?';
    before = byte;
  }
  return text;
}

std::string echo_text(const Message& message) {
  const std::string line = describe(message.channel, message.payload);
  const std::string type = type_name(message.payload);
  RobotMessage robot;
  if (type == "robot_t" && decode(message.channel, message.payload, robot)) {
    return line.substr(0, line.find(" \"")) + indented("yaml", robot.yaml);
  }
  SessionHeader session;
  if (type == "session_t" && decode(message.channel, message.payload, session)) {
    return line + indented("scenario", session.scenario_yaml) + indented("model", session.model_yaml) +
           indented("robot", session.robot_yaml);
  }
  return line;
}

}  // namespace parhelion::tools

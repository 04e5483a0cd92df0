#include "server/tick/instructor_input.hpp"

namespace parhelion::tick {

Status read_command(const ChannelMap& channels, const Message& message, InstructorCommand& command) {
  auto expected = command_on(channels.canonical(message.channel));
  if (!expected) return Error{message.channel + ": not a channel of an instructor's commands"};
  command = std::move(*expected);
  return decode(message.channel, message.payload, command);
}

std::vector<std::string> command_channels(const ChannelMap& channels) {
  std::vector<std::string> names;
  for (const char* canonical : kInstructorChannels) names.push_back(channels.bus(canonical));
  return names;
}

}  // namespace parhelion::tick

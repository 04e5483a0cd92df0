// The instructor's commands as inputs: which type a channel carries.
#pragma once

#include "protocols/bus/bus.hpp"
#include "protocols/codec.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Reads the command as the type of its channel. Error: not a channel of theirs, or as decode() says;
/// `command` then still has what could be read of its request.
Status read_command(const ChannelMap& channels, const Message& message, InstructorCommand& command);

/// Names on the bus of the channels that carry them.
std::vector<std::string> command_channels(const ChannelMap& channels);

/// The instructor's, the emergency stop among them: written to the log before anything is done about it.
inline bool is_command(InputKind kind) {
  return kind == InputKind::command || kind == InputKind::emergency_stop;
}

}  // namespace parhelion::tick

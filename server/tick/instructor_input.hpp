// The instructor's commands as inputs: the channel determines the message type.
#pragma once

#include "protocols/bus/bus.hpp"
#include "protocols/codec.hpp"
#include "server/tick/configuration.hpp"

namespace parhelion::tick {

/// Decodes a command by the type of its channel. Error: not an instructor's channel, or that of decode();
/// `command` then still holds the part of its request that could be read.
Status read_command(const ChannelMap& channels, const Message& message, InstructorCommand& command);

/// Bus names of the channels for instructors' commands.
std::vector<std::string> command_channels(const ChannelMap& channels);

/// Commands of the instructor, including the emergency stop: logged before they are applied.
inline bool is_command(InputKind kind) {
  return kind == InputKind::command || kind == InputKind::emergency_stop;
}

}  // namespace parhelion::tick

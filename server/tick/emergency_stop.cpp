#include "server/tick/emergency_stop.hpp"

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tick {

bool stops_robot(const Configuration& configuration, const Message& message) {
  EmergencyStopCommand command;
  return configuration.channels.kind(message.channel) == InputKind::emergency_stop &&
         decode(message.channel, message.payload, command).ok() && command.engaged &&
         is_for_trainee(configuration, command);
}

Message emergency_stop_message(const Configuration& configuration, const std::string& robot,
                               ArrivalTime now) {
  EmergencyStopCommand command;
  command.stamp = {now.ns};
  command.robot = robot;
  Message message{configuration.channels.bus(channel::kMrEmergencyStop), now, {}};
  encode(command, message.payload);
  return message;
}

}  // namespace parhelion::tick

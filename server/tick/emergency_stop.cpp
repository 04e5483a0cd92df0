#include "server/tick/emergency_stop.hpp"

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tick {

bool stops_robot(const Configuration& configuration, const Message& message) {
  AgentCommand command;
  return configuration.channels.kind(message.channel) == InputKind::agent_command &&
         decode(message.channel, message.payload, command).ok() &&
         is_emergency_stop(configuration, command) && command.action == AgentCommand::Action::freeze;
}

Message stop_of_robot(const Configuration& configuration, ArrivalTime now) {
  AgentCommand command;
  command.stamp = {now.ns};
  command.action = AgentCommand::Action::freeze;
  command.agent.name = configuration.robot.name;
  Message message{configuration.channels.bus(channel::mr_agent_cmd), now, {}};
  encode(command, message.payload);
  return message;
}

}  // namespace parhelion::tick

// Operators and their consoles: whom one drives, what is lost with a console, and who else publishes for the
// robot.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "protocols/bus/bus.hpp"
#include "server/tick/command_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Whom an operator drives, by the console's status.
struct DrivingOperator {
  std::string robot;
  ArrivalTime received;  ///< of the newest status
};

/// By the operators' names, those that drive.
using Operators = std::map<std::string, DrivingOperator>;

/// OPERATOR: the robot that an operator leaves, or whose console is lost, stops.
void handle_operator(const TickContext& context, const Message& input, const CommandPath& path,
                     Operators& operators);
/// At each step: a console that has sent nothing for a second is lost.
void watch_operators(const TickContext& context, const CommandPath& path, Operators& operators);
/// Somebody else's message on a channel that the simulated robot's sensors publish on: an event. `channel`:
/// index in sensor_channels().
void report_foreign_message(const TickContext& context, std::int64_t channel);

}  // namespace parhelion::tick

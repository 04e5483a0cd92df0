// Operators and their consoles: which robot each one drives, and loss of a console.
#pragma once

#include <map>
#include <string>

#include "protocols/bus/bus.hpp"
#include "server/tick/command_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// The robot that an operator drives, from the console's status.
struct DrivingOperator {
  std::string robot;
  ArrivalTime received;  ///< of the newest status
};

/// The driving operators, by name.
using Operators = std::map<std::string, DrivingOperator>;

/// OPERATOR: stops a robot when its operator leaves it or the console is lost.
void handle_operator(const TickContext& context, const Message& input, const CommandPath& path,
                     Operators& operators);
/// At each step: a console without messages for a second is lost.
void watch_operators(const TickContext& context, const CommandPath& path, Operators& operators);

}  // namespace parhelion::tick

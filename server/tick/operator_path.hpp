// Operators and their consoles: which robot each one drives, and loss of a console.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "protocols/bus/bus.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// The robot that an operator drives, from the console's status.
struct DrivingOperator {
  std::string robot;
  ArrivalTime received;  ///< of the newest status
};

/// The driving operators, by name: at most kMaxOperators, since names come from the bus.
using Operators = std::map<std::string, DrivingOperator>;
inline constexpr std::size_t kMaxOperators = 64;

/// Changes of the robots that operators drive, within a second. Each is an event.
struct OperatorSwitches {
  static constexpr int kMaxPerSecond = 20;
  SimulationTime since;
  int count = 0;
};

/// Dependencies of the operator path.
struct OperatorPath {
  Operators& operators;
  OperatorSwitches& switches;
  std::optional<SimulationTime>& refusal_reported;  ///< of an OPERATOR message; none: never
  const simulation::Simulation& simulation;
  std::function<void(const std::string& robot)> stop;  ///< stops a robot or an agent until its next command
  std::function<bool(const std::string& robot)> is_driven;  ///< its dead-man is pressed
  std::function<void(const std::string& robot)> contest;    ///< two consoles claim it
};

/// OPERATOR: stops a robot when its operator leaves it or the console is lost. While an operator's dead-man
/// is pressed, nobody else's claim of that robot is accepted. More operators than kMaxOperators, and more
/// switches a second than OperatorSwitches::kMaxPerSecond, are refused. On a bus without signatures a
/// stranger can use both up. A message that is refused is an event, at most one in ten seconds: consoles send
/// two each second.
void handle_operator(const TickContext& context, const Message& input, const OperatorPath& path);
/// At each step: a console without messages for a second is lost.
void watch_operators(const TickContext& context, const OperatorPath& path);

}  // namespace parhelion::tick

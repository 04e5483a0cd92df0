// Operators and their consoles: which robot each one drives, and loss of a console.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "protocols/bus/bus.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/operator_admission.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// The robot that an operator drives, from the console's status.
struct DrivingOperator {
  std::string robot;
  ArrivalTime received;  ///< of the newest status
  ArrivalTime since;     ///< of the first status, which may be from before the operator was accepted
  ArrivalTime claimed;   ///< of the first accepted status with this robot
  /// When a robot was last driven at a status of this operator, who had claimed it before all others.
  std::optional<SimulationTime> drove;
};

/// The driving operators, by name: at most kMaxOperators, since names come from the bus.
using Operators = std::map<std::string, DrivingOperator>;
inline constexpr std::size_t kMaxOperators = 64;
/// Nobody takes the place of an operator who has driven within this time: a pause between two tasks.
inline constexpr Duration kDriverKept = seconds(60.0);

/// Dependencies of the operator path.
struct OperatorPath {
  Operators& operators;
  OperatorAdmission& admission;
  std::optional<SimulationTime>& refusal_reported;  ///< of an OPERATOR message; none: never
  const simulation::Simulation& simulation;
  std::function<void(const std::string& robot)> stop;  ///< stops a robot or an agent until its next command
  std::function<bool(const std::string& robot)>
      is_driven;  ///< a dead-man is pressed; an agent: commands move it
  std::function<void(const std::string& robot)> contest;  ///< two consoles claim it
};

/// OPERATOR: stops a robot when its operator leaves it or the console is lost. While an operator's dead-man
/// is pressed, nobody else's claim of that robot is accepted. More switches a second than
/// SwitchBudget::kMaxPerSecond are refused; for a name that is repeated, as a console does twice a second,
/// there is a budget of its own. If there are kMaxOperators, such a name displaces one that is newer than
/// itself and idle: its robot is not driven, and it has not driven for kDriverKept; of several, the longest
/// idle. On a bus without signatures a stranger who repeats as many names before can still use both up. A
/// message that is refused is an event, at most one in ten seconds: consoles send two each second.
void handle_operator(const TickContext& context, const Message& input, const OperatorPath& path);
/// At each step: a console without messages for a second is lost.
void watch_operators(const TickContext& context, const OperatorPath& path);

}  // namespace parhelion::tick

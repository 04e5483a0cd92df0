#include "server/tick/operator_path.hpp"

#include <algorithm>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration kRefusalPeriod = seconds(10.0);

void publish(const TickContext& context, EventKind kind, const std::string& subject,
             const std::string& object, const std::string& text) {
  Event event;
  event.stamp = context.now;
  event.kind = kind;
  event.subject = subject;
  event.object = object;
  event.text = text;
  publish_event(context, event);
}

bool can_be_driven(const Configuration& configuration, const std::string& robot,
                   const simulation::Simulation& simulation) {
  if (configuration.find_robot(robot)) return true;
  const AgentDefinition* agent = simulation.find_agent(robot);
  return agent != nullptr && agent->kind == AgentKind::robot;
}

/// Stops the robot unless another operator drives it.
void stop_if_undriven(const std::string& robot, const OperatorPath& path) {
  for (const auto& [name, other] : path.operators) {
    if (other.robot == robot) return;
  }
  path.stop(robot);
}

/// Another operator who claims the robot; empty: none.
std::string other_driver(const std::string& robot, const std::string& operator_name,
                         const Operators& operators) {
  for (const auto& [name, other] : operators)
    if (other.robot == robot && name != operator_name) return name;
  return {};
}

/// A console whose messages are all refused would otherwise be a number in the status.
void refuse_console(const TickContext& context, const OperatorStatus& status, const Error& error,
                    std::optional<SimulationTime>& reported) {
  refuse(context, error);
  if (reported && context.now - *reported < kRefusalPeriod) return;
  reported = context.now;
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::command_refused;
  event.text = "console of operator '" + yaml::printable(status.name) + "': " + error.message;
  publish_event(context, event);
}

bool drove_recently(const DrivingOperator& claim, SimulationTime now) {
  return claim.drove && now - *claim.drove < kDriverKept;
}

/// Whether nobody has claimed the operator's robot before. TELEOP does not name its sender.
bool claimed_first(const DrivingOperator& claim, const Operators& operators) {
  return std::none_of(operators.begin(), operators.end(), [&](const auto& each) {
    return each.second.robot == claim.robot && each.second.claimed < claim.claimed;
  });
}

/// Makes room for a name that is repeated since then. Only a newer one has to go: of two that displaced each
/// other in turn, each would be an event, for as long as both are repeated. False: there is none.
bool displace_idle(const TickContext& context, ArrivalTime since, const OperatorPath& path) {
  Operators& operators = path.operators;
  const auto idle_since = [](const DrivingOperator& claim) {
    return claim.drove.value_or(simulation_time(claim.since));
  };
  auto idlest = operators.end();
  for (auto each = operators.begin(); each != operators.end(); ++each) {
    const DrivingOperator& claim = each->second;
    if (claim.since <= since || drove_recently(claim, context.now) || path.is_driven(claim.robot)) continue;
    if (idlest == operators.end() || idle_since(claim) < idle_since(idlest->second)) idlest = each;
  }
  if (idlest == operators.end()) return false;
  const std::string name = idlest->first, robot = idlest->second.robot;
  operators.erase(idlest);
  stop_if_undriven(robot, path);
  publish(
      context, EventKind::console_lost, name, robot,
      "displaced: " + std::to_string(kMaxOperators) + " operators claim robots, and this one does not drive");
  return true;
}

/// Empty: the operator may drive another robot than before. `known`: nullptr for a new name. `since`: becomes
/// the first status of a name that is repeated.
std::string switch_fault(const TickContext& context, const std::string& name, const DrivingOperator* known,
                         ArrivalTime arrival, const OperatorPath& path, ArrivalTime& since) {
  OperatorAdmission& admission = path.admission;
  const bool is_full = known == nullptr && path.operators.size() >= kMaxOperators;
  bool repeats = false;
  if (known != nullptr) {
    repeats = drove_recently(*known, context.now) || arrival - known->since >= SeenNames::kRepeat;
  } else if (const auto repeated = admission.seen.repeated_since(name, arrival)) {
    repeats = true;
    since = *repeated;
  }
  if (!is_full && admission.first_claims.spend(context.now)) return {};
  if (repeats && admission.repeated.spend(context.now) && (!is_full || displace_idle(context, since, path)))
    return {};
  if (is_full)
    return std::to_string(kMaxOperators) + " operators claim robots already; close an idle console";
  return "operators changed robots more than " + std::to_string(SwitchBudget::kMaxPerSecond) +
         " times within a second";
}

}  // namespace

void handle_operator(const TickContext& context, const Message& input, const OperatorPath& path) {
  Operators& operators = path.operators;
  OperatorStatus status;
  if (const Status read = decode(input.channel, input.payload, status); !read)
    return refuse_console(context, status, read.error(), path.refusal_reported);
  const auto known = operators.find(status.name);
  const std::string before = known != operators.end() ? known->second.robot : "";
  if (status.state == OperatorStatus::State::drives) {
    if (!can_be_driven(context.configuration, status.robot, path.simulation))
      return refuse_console(context, status,
                            {input.channel + ": drives '" + status.robot + "', and there is no such robot"},
                            path.refusal_reported);
    const std::string driver = other_driver(status.robot, status.name, operators);
    if (!driver.empty()) path.contest(status.robot);
    if (before != status.robot && !driver.empty() && path.is_driven(status.robot)) {
      operators.erase(status.name);
      if (!before.empty()) stop_if_undriven(before, path);
      const std::string who = yaml::printable(driver);
      return refuse_console(context, status,
                            {"'" + who + "' drives '" + status.robot + "': wait until " + who +
                             " has released the dead-man, or choose another robot"},
                            path.refusal_reported);
    }
    ArrivalTime since = input.arrival;
    if (before != status.robot) {
      const std::string fault =
          switch_fault(context, status.name, known == operators.end() ? nullptr : &known->second,
                       input.arrival, path, since);
      if (!fault.empty()) {
        operators.erase(status.name);
        if (!before.empty()) stop_if_undriven(before, path);
        return refuse_console(context, status, {input.channel + ": " + fault}, path.refusal_reported);
      }
    }
    const auto accepted = operators.try_emplace(status.name, DrivingOperator{{}, {}, since, {}, {}}).first;
    DrivingOperator& claim = accepted->second;
    if (before != status.robot) claim.claimed = input.arrival;
    claim.robot = status.robot;
    claim.received = input.arrival;
    if (path.is_driven(status.robot) && claimed_first(claim, operators)) claim.drove = context.now;
    if (before == status.robot) return;
    if (!before.empty()) stop_if_undriven(before, path);
    return publish(context, EventKind::operator_switched, status.name, status.robot, status.text);
  }
  if (known == operators.end()) return;
  operators.erase(known);
  stop_if_undriven(before, path);
  if (status.state == OperatorStatus::State::lost)
    publish(context, EventKind::console_lost, status.name, before, status.text);
}

void watch_operators(const TickContext& context, const OperatorPath& path) {
  Operators& operators = path.operators;
  for (auto each = operators.begin(); each != operators.end();) {
    if (context.now - simulation_time(each->second.received) < driving_timing::kConsoleSilence) {
      ++each;
      continue;
    }
    const std::string name = each->first, robot = each->second.robot;
    each = operators.erase(each);
    stop_if_undriven(robot, path);
    publish(context, EventKind::console_lost, name, robot, "no messages for 1 s");
  }
}

}  // namespace parhelion::tick

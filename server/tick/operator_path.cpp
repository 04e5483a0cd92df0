// Operators and their consoles: whom one drives, what is lost with a console, and who else speaks for the
// robot.
#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "server/tick/foreign_publisher.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration console_silence = seconds(1.0);  // consoles speak at least twice a second

void say(const Configuration& configuration, EventKind kind, SimulationTime now, const std::string& subject,
         const std::string& object, const std::string& text, State& state, Outputs& outputs) {
  Event event;
  event.stamp = now;
  event.kind = kind;
  event.subject = subject;
  event.object = object;
  event.text = text;
  publish_event(configuration, event, state, outputs);
}

bool can_be_driven(const Configuration& configuration, const std::string& robot, const State& state) {
  if (robot == configuration.robot.name) return true;
  const AgentDefinition* agent = state.simulation.find_agent(robot);
  return agent != nullptr && agent->kind == AgentKind::robot;
}

void let_go(const Configuration& configuration, const std::string& robot, ArrivalTime now, State& state,
            Outputs& outputs) {
  // Another operator may drive it still.
  for (const auto& [name, other] : state.operators) {
    if (other.robot == robot) return;
  }
  stop_robot(configuration, robot, now, state, outputs);
}

}  // namespace

void take_operator_word(const Configuration& configuration, const Message& input, State& state,
                        Outputs& outputs) {
  OperatorWord word;
  if (const Status read = decode(input.channel, input.payload, word); !read)
    return refuse(read.error(), state);
  const SimulationTime now = simulation_time(input.arrival);
  const auto known = state.operators.find(word.name);
  const std::string before = known != state.operators.end() ? known->second.robot : "";
  if (word.state == OperatorWord::State::drives) {
    if (!can_be_driven(configuration, word.robot, state))
      return refuse({input.channel + ": operator '" + word.name + "' drives '" + word.robot +
                     "', and there is no such robot"},
                    state);
    state.operators[word.name] = {word.robot, input.arrival};
    if (before == word.robot) return;
    if (!before.empty()) let_go(configuration, before, input.arrival, state, outputs);
    return say(configuration, EventKind::operator_switched, now, word.name, word.robot, word.text, state,
               outputs);
  }
  if (known == state.operators.end()) return;
  state.operators.erase(known);
  let_go(configuration, before, input.arrival, state, outputs);
  if (word.state == OperatorWord::State::lost)
    say(configuration, EventKind::console_lost, now, word.name, before, word.text, state, outputs);
}

void watch_operators(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  for (auto each = state.operators.begin(); each != state.operators.end();) {
    if (now - simulation_time(each->second.heard) < console_silence) {
      ++each;
      continue;
    }
    const std::string name = each->first, robot = each->second.robot;
    each = state.operators.erase(each);
    let_go(configuration, robot, ArrivalTime{now.ns}, state, outputs);
    say(configuration, EventKind::console_lost, now, name, robot, "nothing heard for 1 s", state, outputs);
  }
}

void note_foreign_message(const Configuration& configuration, SimulationTime now, std::int64_t channel,
                          State& state, Outputs& outputs) {
  if (channel == another_server())
    return say(configuration, EventKind::foreign_publisher, now, configuration.robot.name,
               configuration.channels.bus(channel::mr_status), another_server_text, state, outputs);
  const auto& names = sensor_channels();
  if (channel < 0 || channel >= static_cast<std::int64_t>(names.size())) return;
  const std::string name = configuration.channels.bus(names[static_cast<std::size_t>(channel)]);
  say(configuration, EventKind::foreign_publisher, now, configuration.robot.name, name,
      "somebody else publishes on " + name + ", which the simulated robot's sensors speak on; it is ignored",
      state, outputs);
}

}  // namespace parhelion::tick

// parhelion inject: the instructor's commands from a shell. Exit 0 means that the server has written and done
// it.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>
#include <map>
#include <numbers>

#include "protocols/bus/bus.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/wall_clock.hpp"
#include "tools/command.hpp"

namespace parhelion {
namespace {

struct Arguments {
  std::string action, name, kind = "box", at, size, behaviour = "stay", laser, url,
                            channel = channel::mr_agent_cmd;
  std::vector<std::string> waypoints;
  double speed = 0.5, timeout = 2.0;
};

const std::map<std::string, AgentCommand::Action> actions{
    {"spawn", AgentCommand::Action::spawn},           {"move", AgentCommand::Action::move},
    {"remove", AgentCommand::Action::remove},         {"behave", AgentCommand::Action::behave},
    {"remove-all", AgentCommand::Action::remove_all}, {"freeze", AgentCommand::Action::freeze},
    {"unfreeze", AgentCommand::Action::unfreeze}};
const std::map<std::string, AgentKind> kinds{{"box", AgentKind::box},
                                             {"barrel", AgentKind::barrel},
                                             {"person", AgentKind::person},
                                             {"robot", AgentKind::robot}};
const std::map<std::string, BehaviourKind> behaviours{{"stay", BehaviourKind::stay},
                                                      {"patrol", BehaviourKind::patrol},
                                                      {"wander", BehaviourKind::wander},
                                                      {"teleop", BehaviourKind::teleop}};

/// "1.5,2,90" as three numbers; fewer are left as they are. False: not that.
bool parse_numbers(const std::string& text, double* numbers, std::size_t at_least, std::size_t at_most) {
  std::size_t count = 0;
  const char* at = text.data();
  const char* end = at + text.size();
  while (true) {
    if (count == at_most) return false;
    const auto [next, error] = std::from_chars(at, end, numbers[count]);
    if (error != std::errc() || !std::isfinite(numbers[count])) return false;
    ++count;
    if (next == end) return count >= at_least;
    if (*next != ',') return false;
    at = next + 1;
  }
}

Exit fail(const std::string& what, Exit exit = Exit::failed) {
  std::fprintf(stderr, "parhelion inject: %s\n", what.c_str());
  return exit;
}

Result<AgentCommand> make_command(const Arguments& arguments) {
  AgentCommand command;
  command.action = actions.at(arguments.action);
  command.stamp = {wall_now().ns};
  command.request = static_cast<std::uint64_t>(wall_now().ns) ^ (static_cast<std::uint64_t>(getpid()) << 48);
  AgentDefinition& agent = command.agent;
  agent.name = arguments.name;
  agent.kind = kinds.at(arguments.kind);
  agent.laser = arguments.laser;
  agent.behaviour.kind = behaviours.at(arguments.behaviour);
  agent.behaviour.speed = arguments.speed;
  const bool whole_scene = command.action >= AgentCommand::Action::remove_all;
  if (!whole_scene && agent.name.empty()) return Error{"which agent? give --name NAME"};
  const bool needs_place =
      command.action == AgentCommand::Action::spawn || command.action == AgentCommand::Action::move;
  if (needs_place) {
    double place[3] = {0, 0, 0};
    if (!parse_numbers(arguments.at, place, 2, 3))
      return Error{"--at: expected X,Y or X,Y,YAW in metres and degrees, such as 2.5,1,90"};
    agent.T_map_base = Transform<Map, Base>::planar(place[0], place[1], place[2] * std::numbers::pi / 180);
  }
  if (!arguments.size.empty() && !parse_numbers(arguments.size, agent.size.data(), 3, 3)) {
    return Error{"--size: expected X,Y,Z in metres, such as 0.4,0.4,0.6"};
  }
  for (const std::string& text : arguments.waypoints) {
    Eigen::Vector2d waypoint;
    if (!parse_numbers(text, waypoint.data(), 2, 2))
      return Error{"--waypoint: expected X,Y in metres, such as 2.5,1"};
    agent.behaviour.waypoints.push_back(waypoint);
  }
  return command;
}

/// Waits for the event that carries the request.
Exit await_answer(Bus& bus, std::uint64_t request, double timeout) {
  const WallTime deadline = steady_now() + seconds(timeout);
  while (steady_now() < deadline) {
    Message message;
    const auto received = bus.receive(message, deadline - steady_now());
    if (!received) return fail(received.error().message);
    if (!*received) break;
    Event event;
    if (!decode(message.channel, message.payload, event) || event.request != request) continue;
    if (event.kind == EventKind::command_refused) return fail("refused: " + event.text);
    if (event.kind != EventKind::command_accepted) continue;
    std::printf("done%s%s\n", event.text.empty() ? "" : ": ", event.text.c_str());
    return Exit::done;
  }
  char waited[32];
  std::snprintf(waited, sizeof waited, "%g", timeout);
  return fail("no server answered in " + std::string(waited) +
              " s; is `parhelion serve` running on this LCM network?");
}

Exit run(const Arguments& arguments) {
  const auto command = make_command(arguments);
  if (!command) return fail(command.error().message, Exit::usage);
  auto bus = open_network_bus(arguments.url);
  if (!bus) return fail(bus.error().message);
  if (const Status subscribed = (*bus)->subscribe(channel::mr_events, 256); !subscribed) {
    return fail(subscribed.error().message);
  }
  std::vector<std::uint8_t> payload;
  encode(*command, payload);
  if (const Status sent = (*bus)->publish(arguments.channel, payload); !sent)
    return fail(sent.error().message);
  return await_answer(**bus, command->request, arguments.timeout);
}

std::vector<std::string> keys(const auto& map) {
  std::vector<std::string> names;
  for (const auto& [name, value] : map) names.push_back(name);
  return names;
}

}  // namespace

void add_inject(CLI::App& app, Exit& exit) {
  CLI::App* command =
      app.add_subcommand("inject", "Add, move, remove or command virtual agents on a running server");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("action", arguments->action, "What to do")
      ->required()
      ->check(CLI::IsMember(keys(actions)));
  command->add_option("--name", arguments->name, "The agent's name");
  command->add_option("--kind", arguments->kind, "What it is")->check(CLI::IsMember(keys(kinds)));
  command->add_option("--at", arguments->at, "X,Y or X,Y,YAW in the map: metres, degrees");
  command->add_option("--size", arguments->size, "X,Y,Z of a box or barrel, metres");
  command->add_option("--behaviour", arguments->behaviour, "What it does")
      ->check(CLI::IsMember(keys(behaviours)));
  command->add_option("--waypoint", arguments->waypoints, "X,Y of a patrol; several times")->take_all();
  command->add_option("--speed", arguments->speed, "m/s")->check(CLI::Range(0.0, 5.0));
  command->add_option("--laser", arguments->laser, "Preset of its own laser, such as lms-200");
  command->add_option("--timeout", arguments->timeout, "Seconds to wait for the server")
      ->check(CLI::PositiveNumber);
  command->add_option("--channel", arguments->channel, "Channel of agent commands");
  command->add_option("--url", arguments->url, "LCM URL");
  command->footer(
      "Example: parhelion inject spawn --name robot_4 --kind robot --at 2.5,1,90 --behaviour wander --laser "
      "lms-200");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion

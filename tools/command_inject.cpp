// parhelion inject: the instructor's commands from a shell. Exit 0 means that the server has written and done
// it.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "protocols/bus/bus.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/lesson.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tools/command.hpp"
#include "tools/place_argument.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string action, name, kind = "box", at, size, behaviour = "stay", laser, model, target, url,
                            channel = channel::mr_agent_cmd, side;
  std::vector<std::string> waypoints;
  double speed = 0.5, distance = 1.5, timeout = 2.0;
  std::optional<double> amount, rate;
  double lasting = 0;
  bool yields = false, leaves_doors = false;
};

const std::map<std::string, AgentCommand::Action> actions{
    {"spawn", AgentCommand::Action::spawn},           {"move", AgentCommand::Action::move},
    {"remove", AgentCommand::Action::remove},         {"behave", AgentCommand::Action::behave},
    {"remove-all", AgentCommand::Action::remove_all}, {"freeze", AgentCommand::Action::freeze},
    {"unfreeze", AgentCommand::Action::unfreeze},     {"reset", AgentCommand::Action::move},
    {"report", AgentCommand::Action::report},         {"script", AgentCommand::Action::script},
    {"lesson", AgentCommand::Action::lesson},         {"lesson-over", AgentCommand::Action::lesson_over},
    {"camera", AgentCommand::Action::camera}};
const std::map<std::string, AgentKind> kinds{
    {"box", AgentKind::box},     {"barrel", AgentKind::barrel},       {"person", AgentKind::person},
    {"robot", AgentKind::robot}, {"container", AgentKind::container}, {"cable", AgentKind::cable}};
const std::map<std::string, BehaviourKind> behaviours{
    {"stay", BehaviourKind::stay},     {"patrol", BehaviourKind::patrol}, {"wander", BehaviourKind::wander},
    {"teleop", BehaviourKind::teleop}, {"follow", BehaviourKind::follow}, {"flee", BehaviourKind::flee},
    {"block", BehaviourKind::block},   {"go", BehaviourKind::go}};

Exit fail(const std::string& what, Exit exit = Exit::failed) {
  std::fprintf(stderr, "parhelion inject: %s\n", what.c_str());
  return exit;
}

bool means_all(AgentCommand::Action action) {
  using Action = AgentCommand::Action;
  return action == Action::remove_all || action == Action::freeze || action == Action::unfreeze;
}

/// What the name is of.
std::string about(AgentCommand::Action action) {
  using Action = AgentCommand::Action;
  if (action == Action::report) return "find";
  if (action == Action::script) return "script";
  return action == Action::lesson || action == Action::lesson_over ? "lesson" : "agent";
}

/// Amount and seconds go where AgentCommand::Action::lesson says.
Status put_lesson(const Arguments& arguments, AgentDefinition& agent) {
  const bool wheel = agent.name == to_string(Lesson::Kind::dead_wheel);
  if (wheel && arguments.side.empty()) return Error{"which side's wheels? give --side left or --side right"};
  if (!wheel && !arguments.amount)
    return Error{"how much? give --amount: s of camera_delay, a share of what is lost"};
  const double amount = wheel ? (arguments.side == "right" ? 1 : 0) : *arguments.amount;
  agent.T_map_base = Transform<Map, Base>::planar(amount, arguments.lasting, 0);
  return {};
}

Result<AgentCommand> make_command(const Arguments& arguments) {
  AgentCommand command;
  command.action = actions.at(arguments.action);
  command.stamp = {runtime::wall_now().ns};
  command.request =
      static_cast<std::uint64_t>(runtime::wall_now().ns) ^ (static_cast<std::uint64_t>(getpid()) << 48);
  AgentDefinition& agent = command.agent;
  agent.name = arguments.name;
  agent.kind = kinds.at(arguments.kind);
  agent.laser = arguments.laser;
  agent.model = arguments.model;
  agent.behaviour.kind = behaviours.at(arguments.behaviour);
  agent.behaviour.speed = arguments.speed;
  agent.behaviour.target = arguments.target;
  agent.behaviour.distance = arguments.distance;
  agent.behaviour.yields = arguments.yields;
  agent.behaviour.opens_doors = !arguments.leaves_doors;
  const bool report = command.action == AgentCommand::Action::report;
  if (!means_all(command.action) && agent.name.empty())
    return Error{"which " + about(command.action) + "? give --name NAME"};
  const bool needs_place =
      command.action == AgentCommand::Action::spawn || command.action == AgentCommand::Action::move;
  if (report && !arguments.at.empty()) command.action = AgentCommand::Action::report_at;
  const bool reset = arguments.action == "reset";
  if ((needs_place && !reset) || command.action == AgentCommand::Action::report_at) {
    const auto place = parse_place(arguments.at, false);
    if (!place) return Error{"--at '" + arguments.at + "': " + place.error().message};
    agent.T_map_base = Transform<Map, Base>::planar(place->x(), place->y(), place->z());
  }
  if (command.action == AgentCommand::Action::lesson) {
    if (const Status said = put_lesson(arguments, agent); !said) return said.error();
  }
  if (command.action == AgentCommand::Action::camera) {
    if (!arguments.rate) return Error{"how many pictures a second? give --rate, 0 for none"};
    agent.T_map_base = Transform<Map, Base>::planar(*arguments.rate, 0, 0);
  }
  if (!arguments.size.empty()) {
    const auto size = parse_lengths(arguments.size);
    if (!size) return Error{"--size '" + arguments.size + "': " + size.error().message};
    agent.size = *size;
  }
  for (const std::string& text : arguments.waypoints) {
    const auto waypoint = parse_point(text);
    if (!waypoint) return Error{"--waypoint '" + text + "': " + waypoint.error().message};
    agent.behaviour.waypoints.push_back(*waypoint);
  }
  return command;
}

/// A reset puts it down where it is now: upright, at rest, its joints whole and where they start.
Status find_place(Bus& bus, const Arguments& arguments, AgentDefinition& agent) {
  const WallTime deadline = runtime::steady_now() + seconds(arguments.timeout);
  while (runtime::steady_now() < deadline) {
    Message message;
    const auto received = bus.receive(message, deadline - runtime::steady_now());
    if (!received) return received.error();
    WorldMessage world;
    if (!*received || message.channel != channel::mr_world) continue;
    if (!decode(message.channel, message.payload, world)) continue;
    const auto body = std::find_if(world.bodies.begin(), world.bodies.end(),
                                   [&](const auto& each) { return each.entity == agent.name; });
    if (body == world.bodies.end()) return Error{"nothing is called '" + agent.name + "'"};
    const Eigen::Vector3d p = body->T_map_body.translation();
    const Eigen::Matrix3d R = body->T_map_body.rotation();
    agent.T_map_base = Transform<Map, Base>::planar(p.x(), p.y(), std::atan2(R(1, 0), R(0, 0)), p.z());
    return {};
  }
  return Error{"no server says where it is; is `parhelion serve` running on this LCM network?"};
}

/// Waits for the event that carries the request.
Exit await_answer(Bus& bus, std::uint64_t request, double timeout) {
  const WallTime deadline = runtime::steady_now() + seconds(timeout);
  while (runtime::steady_now() < deadline) {
    Message message;
    const auto received = bus.receive(message, deadline - runtime::steady_now());
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
  auto command = make_command(arguments);
  if (!command) return fail(command.error().message, Exit::usage);
  auto bus = open_network_bus(arguments.url);
  if (!bus) return fail(bus.error().message);
  if (const Status subscribed = (*bus)->subscribe(channel::mr_events, 256); !subscribed) {
    return fail(subscribed.error().message);
  }
  if (arguments.action == "reset") {
    Status found = (*bus)->subscribe(channel::mr_world, 1);
    if (found) found = find_place(**bus, arguments, command->agent);
    if (!found) return fail(found.error().message);
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
  CLI::App* command = app.add_subcommand("inject",
                                         "Add, move, remove or command virtual agents on a running server, "
                                         "begin scripts and lessons, report a find");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("action", arguments->action, "What to do")
      ->required()
      ->check(CLI::IsMember(keys(actions)));
  command->add_option("--name", arguments->name,
                      "The agent's name; of a report what was found; of a script; the kind of a lesson");
  command->add_option("--kind", arguments->kind, "What it is")->check(CLI::IsMember(keys(kinds)));
  command->add_option("--at", arguments->at, std::string("X,Y or ") + place_format);
  command->add_option("--size", arguments->size,
                      "X,Y,Z of a box, barrel or container: metres, or with units; LENGTH,D,D of a cable");
  command->add_option("--behaviour", arguments->behaviour, "What it does")
      ->check(CLI::IsMember(keys(behaviours)));
  command
      ->add_option("--waypoint", arguments->waypoints,
                   "X,Y of a patrol or a way to go: metres, or with units; several times")
      ->take_all();
  command->add_option("--target", arguments->target,
                      "Whom it follows, flees or blocks: an agent; the trainee's robot where none is named");
  command->add_option("--distance", arguments->distance, "Metres that it keeps to the target")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--yields", arguments->yields, "It steps aside for a robot that comes at it");
  command->add_flag("--leaves-doors", arguments->leaves_doors, "It pushes no doors open");
  command->add_option("--amount", arguments->amount,
                      "Of a lesson: s of camera_delay, share of camera_loss and laser_dropouts");
  command->add_option("--side", arguments->side, "Of the lesson dead_wheel")
      ->check(CLI::IsMember({"left", "right"}));
  command
      ->add_option("--lasting", arguments->lasting,
                   "Seconds that a lesson lasts; without it until lesson-over")
      ->check(CLI::PositiveNumber);
  command->add_option("--rate", arguments->rate, "Pictures a second that a robot's camera sends; 0: none")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--speed", arguments->speed, "m/s")->check(CLI::Range(0.0, 5.0));
  command->add_option("--laser", arguments->laser, "Preset of its own laser, such as lms-200");
  command->add_option("--model", arguments->model, "Robot model of a robot, such as rover");
  command->add_option("--timeout", arguments->timeout, "Seconds to wait for the server")
      ->check(CLI::PositiveNumber);
  command->add_option("--channel", arguments->channel, "Channel of agent commands");
  command->add_option("--url", arguments->url, "LCM URL");
  command->footer(
      "Example: parhelion inject spawn --name robot_4 --kind robot --at 2.5,1,90deg --behaviour wander "
      "--laser "
      "lms-200\n"
      "         parhelion inject behave --name guide --behaviour follow --distance 2\n"
      "         parhelion inject report --name gauge_1 --at 4.2,1.5    (the trainee has found it there)\n"
      "         parhelion inject script --name 'door slams'\n"
      "         parhelion inject lesson --name camera_delay --amount 0.3 --lasting 30\n"
      "         parhelion inject lesson --name dead_wheel --side left\n"
      "         parhelion inject lesson-over --name dead_wheel\n"
      "         parhelion inject camera --name robot_4 --rate 5    (of a robot with a model)\n"
      "         parhelion inject freeze --name robot    (the trainee's: an emergency stop; unfreeze takes it "
      "back)\n"
      "         parhelion inject reset --name trainee\n\n"
      "reset puts a robot down where it is: upright, at rest, what broke of its arm whole again.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools

// parhelion inject: the instructor's commands from a shell. Exit code 0: the server has written and executed
// the command.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "protocols/bus/bus.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/enumerators.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tools/command.hpp"
#include "tools/inject_messages.hpp"
#include "tools/place_argument.hpp"
#include "tools/topic_text.hpp"

namespace parhelion::tools {
namespace {

/// The removal of a crowd is two events for each agent, and a server that cannot keep up refuses many
/// commands at once: the one event that is waited for must not be displaced by these.
constexpr int kMaxEvents = 20'000;

Exit fail(const std::string& what, Exit exit = Exit::failed) {
  std::fprintf(stderr, "parhelion inject: %s\n", what.c_str());
  return exit;
}

/// A reset places the robot at its current position: upright, at rest, its joints intact and in their initial
/// positions.
Status find_place(Bus& bus, const InjectArguments& arguments, AgentMove& command) {
  const WallTime deadline = runtime::steady_now() + seconds(arguments.timeout);
  while (runtime::steady_now() < deadline) {
    Message message;
    const auto received = bus.receive(message, deadline - runtime::steady_now());
    if (!received) return received.error();
    WorldMessage world;
    if (!*received || message.channel != channel::kMrWorld) continue;
    if (!decode(message.channel, message.payload, world)) continue;
    const auto body = std::find_if(world.bodies.begin(), world.bodies.end(),
                                   [&](const auto& each) { return each.entity == command.agent; });
    if (body == world.bodies.end()) return Error{"there is no entity '" + command.agent + "'"};
    const Eigen::Vector3d p = body->T_map_body.translation();
    const Eigen::Matrix3d R = body->T_map_body.rotation();
    command.T_map_base = Transform<Map, Base>::planar(p.x(), p.y(), std::atan2(R(1, 0), R(0, 0)), p.z());
    return {};
  }
  return Error{"no server has published its pose; is `parhelion serve` running on this LCM network?"};
}

/// Waits for the event with this request number.
Exit await_answer(Bus& bus, std::uint64_t request, double timeout) {
  const WallTime deadline = runtime::steady_now() + seconds(timeout);
  while (runtime::steady_now() < deadline) {
    Message message;
    const auto received = bus.receive(message, deadline - runtime::steady_now());
    if (!received) return fail(received.error().message);
    if (!*received) break;
    Event event;
    if (!decode(message.channel, message.payload, event) || event.request != request) continue;
    if (event.kind == EventKind::command_refused) return fail("refused: " + printable(event.text));
    if (event.kind != EventKind::command_accepted) continue;
    std::printf("done%s%s\n", event.text.empty() ? "" : ": ", printable(event.text).c_str());
    return Exit::done;
  }
  char waited[32];
  std::snprintf(waited, sizeof waited, "%g", timeout);
  return fail("no server replied within " + std::string(waited) +
              " s; is `parhelion serve` running on this LCM network, and does it accept these --keys?");
}

Exit run(const InjectArguments& arguments) {
  auto command = make_command(arguments);
  if (!command) return fail(command.error().message, Exit::usage);
  auto bus = arguments.bus.open("inject");
  if (!bus) return fail(bus.error().message);
  if (const Status subscribed = (*bus)->subscribe(channel::kMrEvents, kMaxEvents); !subscribed) {
    return fail(subscribed.error().message);
  }
  if (arguments.action == "reset") {
    Status found = (*bus)->subscribe(channel::kMrWorld, 1);
    if (found) found = find_place(**bus, arguments, std::get<AgentMove>(*command));
    if (!found) return fail(found.error().message);
  }
  std::vector<std::uint8_t> payload;
  encode(*command, payload);
  const std::string channel = arguments.channel.empty() ? channel_of(*command) : arguments.channel;
  if (const Status sent = (*bus)->publish(channel, payload); !sent) return fail(sent.error().message);
  return await_answer(**bus, request_of(*command), arguments.timeout);
}

}  // namespace

void add_inject(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("inject",
                                         "Add, move, remove or command virtual agents on a running server, "
                                         "open doors, start scripts and faults, report an object, "
                                         "stop a robot");
  auto arguments = std::make_shared<InjectArguments>();
  command->add_option("action", arguments->action, "Action")
      ->required()
      ->check(CLI::IsMember(inject_actions()));
  command->add_option(
      "--name", arguments->name,
      "Name of the agent, door, script or robot; for a report, of what was found; for a fault, its kind");
  command->add_option("--kind", arguments->kind, "Kind of agent")
      ->check(CLI::IsMember(names_up_to(kLastAgentKind)));
  command->add_option("--at", arguments->at, std::string("X,Y or ") + kPlaceFormat);
  command->add_option("--size", arguments->size,
                      "X,Y,Z of a box, barrel or container: metres, or with units; LENGTH,D,D of a cable");
  command->add_option("--behaviour", arguments->behaviour, "Behaviour")
      ->check(CLI::IsMember(names_up_to(kLastBehaviourKind)));
  command
      ->add_option("--waypoint", arguments->waypoints,
                   "X,Y of a waypoint of patrol or go: metres, or with units; may be repeated")
      ->take_all();
  command->add_option("--target", arguments->target,
                      "Target of follow, flee or block: an agent; by default the trainee's robot");
  command->add_option("--distance", arguments->distance, "Distance from the target, m")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("--yields", arguments->yields, "It avoids approaching robots");
  command->add_flag("--leaves-doors", arguments->leaves_doors, "The agent does not push doors open");
  command->add_option("--amount", arguments->amount,
                      "For a fault: seconds for camera_delay, fraction for camera_loss and laser_dropouts");
  command->add_option("--side", arguments->side, "Side of the fault dead_wheel")
      ->check(CLI::IsMember({"left", "right"}));
  command
      ->add_option("--lasting", arguments->lasting, "Seconds that a fault lasts; without it until end-fault")
      ->check(CLI::PositiveNumber);
  command->add_option("--opening", arguments->opening, "Opening angle of a door, rad; by default as sensed");
  command->add_option("--rate", arguments->rate, "Pictures per second of a robot's camera; 0: none")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--speed", arguments->speed, "m/s")->check(CLI::Range(0.0, 5.0));
  command->add_option("--laser", arguments->laser, "Preset of the agent's laser, such as lms-200");
  command->add_option("--model", arguments->model, "Robot model of a robot, such as rover");
  command->add_option("--timeout", arguments->timeout, "Seconds to wait for the server")
      ->check(CLI::PositiveNumber);
  command->add_option("--channel", arguments->channel, "Channel of this command, if the scenario renames it");
  arguments->bus.add_to(*command);
  command->footer(
      "Example: parhelion inject spawn --name robot_4 --kind robot --at 2.5,1,90deg --behaviour wander "
      "--laser "
      "lms-200\n"
      "         parhelion inject behave --name guide --behaviour follow --distance 2\n"
      "         parhelion inject report --name gauge_1 --at 4.2,1.5    (the trainee has found it there)\n"
      "         parhelion inject script --name 'door slams'\n"
      "         parhelion inject fault --name camera_delay --amount 0.3 --lasting 30\n"
      "         parhelion inject fault --name dead_wheel --side left\n"
      "         parhelion inject end-fault --name dead_wheel\n"
      "         parhelion inject camera --name robot_4 --rate 5    (of a robot with a model)\n"
      "         parhelion inject door --name 'door 3' --opening 1.2    (rad; without --opening: as the "
      "sensors see "
      "it)\n"
      "         parhelion inject emergency-stop    (of the trainee's robot; release-emergency-stop ends it)\n"
      "         parhelion inject reset --name trainee\n\n"
      "reset places a robot at its current position: upright, at rest, broken joints of its arm repaired.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools

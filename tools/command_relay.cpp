// parhelion relay: runs on the robot, between the site's bus and the robot's own.
#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <memory>
#include <thread>

#include "protocols/bus/multicast_group.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tools/bus_options.hpp"
#include "tools/command.hpp"
#include "tools/relay.hpp"
#include "tools/robot_bus_guard.hpp"
#include "tools/stop_signal.hpp"

namespace parhelion::tools {
namespace {

constexpr Duration kPoll = milliseconds(20);
constexpr Duration kRefreshPeriod = seconds(1.0);
constexpr int kCapacity = 64;  // messages of each channel

struct Arguments {
  BusOptions site;
  std::string robot = "udpm://239.255.76.68:7668?ttl=0";
  std::vector<std::string> to_robot = channels_to_robot(), from_robot = channels_from_robot();
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion relay: %s\n", what.c_str());
  return Exit::failed;
}

Status subscribe(Bus& bus, const std::vector<std::string>& channels) {
  for (const std::string& channel : channels) {
    if (Status done = bus.subscribe(channel, kCapacity); !done) return done;
  }
  return {};
}

Exit run(const Arguments& arguments) {
  catch_stop_signals();
  if (arguments.site.keys.empty())
    return fail(
        "expected --keys FILE: the relay passes on only what the server signed; see: parhelion key new");
  if (bus_address(chosen_lcm_url(arguments.site.url)) == bus_address(arguments.robot))
    return fail("--url and --robot-url name the same bus (" + bus_address(arguments.robot) +
                "); the robot needs one of its own, such as udpm://239.255.76.68:7668?ttl=0");
  const auto site = arguments.site.open("relay");
  if (!site) return fail(site.error().message);
  const auto robot = open_network_bus(arguments.robot);
  if (!robot) return fail(robot.error().message);
  if (const Status done = subscribe(**site, arguments.to_robot); !done) return fail(done.error().message);
  if (const Status done = subscribe(**robot, arguments.from_robot); !done) return fail(done.error().message);
  RobotBusGuard guard(parse_lcm_url(arguments.robot)->port);
  if (const std::string open = open_group(arguments.robot); !open.empty())
    std::fprintf(stderr, "parhelion relay: warning: %s\n", open.c_str());
  std::fprintf(stderr, "parhelion relay: relaying between %s and %s; stop with ^C\n",
               bus_address(chosen_lcm_url(arguments.site.url)).c_str(), bus_address(arguments.robot).c_str());
  std::atomic<bool> ended = false;
  Status outwards;
  std::jthread from_robot([&] {
    Message message;
    WallTime refreshed = runtime::steady_now();
    while (outwards && !stop_asked() && !ended) {
      outwards = relay_from_robot(**robot, **site, message, kPoll);
      if (runtime::steady_now() - refreshed < kRefreshPeriod) continue;
      guard.refresh();
      refreshed = runtime::steady_now();
    }
    ended = true;
  });
  RelayToRobot to_robot(**site, **robot);
  Status inwards;
  while (inwards && !stop_asked() && !ended) inwards = to_robot.turn(kPoll);
  ended = true;
  from_robot.join();
  const Status stopped = to_robot.stop();
  for (const Status& status : {inwards, outwards, stopped}) {
    if (!status) return fail(status.error().message);
  }
  return Exit::done;
}

}  // namespace

void add_relay(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand(
      "relay",
      "On the robot: pass on what the server signed to the robot's own bus, and sign what the robot sends");
  auto arguments = std::make_shared<Arguments>();
  arguments->site.add_to(*command);
  command->add_option("--robot-url", arguments->robot, "LCM URL of the robot's own bus")
      ->capture_default_str();
  command
      ->add_option("--to-robot", arguments->to_robot, "Channel from the server to the robot; may be repeated")
      ->capture_default_str();
  command
      ->add_option("--from-robot", arguments->from_robot,
                   "Channel from the robot to the server; may be repeated")
      ->capture_default_str();
  command->footer("Example: parhelion relay --keys rover.keys --url udpm://239.255.76.67:7667?ttl=1");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools

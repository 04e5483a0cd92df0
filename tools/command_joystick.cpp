// parhelion joystick: a joystick or game pad as a console.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <thread>

#include "server/runtime/wall_clock.hpp"
#include "server/station/console/operator_console.hpp"
#include "tools/bus_options.hpp"
#include "tools/command.hpp"
#include "tools/consoles/joystick_console.hpp"
#include "tools/stop_signal.hpp"

namespace parhelion::tools {
namespace {

constexpr Duration kPollPeriod = milliseconds(5);

struct Arguments {
  std::string mapping, robot, name = "operator";
  BusOptions bus;
  bool list = false;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion joystick: %s\n", what.c_str());
  return Exit::failed;
}

Exit list() {
  auto port = station::JoystickPort::open();
  if (!port) return fail(port.error().message);
  const auto devices = (*port)->list();
  if (devices.empty()) std::printf("no joystick is plugged in\n");
  for (const station::JoystickName& device : devices) {
    std::printf("%s: axis 0 to %d, button 0 to %d%s\n", device.name.c_str(), device.axes - 1,
                device.buttons - 1, device.game_controller ? ", a game controller" : "");
  }
  for (const station::JoystickName& device : devices) {
    const auto state = (*port)->poll(device.name);
    if (!state) continue;
    std::printf("%s has", (*port)->in_use().c_str());
    for (const auto& [axis, value] : state->axes) std::printf(" '%s'", axis.c_str());
    for (const auto& [button, down] : state->buttons) std::printf(" '%s'", button.c_str());
    std::printf("\n");
    break;
  }
  return Exit::done;
}

Exit drive(const Arguments& arguments, station::JoystickMapping mapping, Bus& bus,
           station::JoystickPort& port) {
  const auto notify = [](const std::string& line) {
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  };
  JoystickConsole console({arguments.robot, arguments.name, notify}, std::move(mapping), bus, port);
  if (const Status listening = console.listen(); !listening) return fail(listening.error().message);
  while (!stop_asked()) {
    if (const Status done = console.turn(runtime::steady_now(), {runtime::wall_now().ns}); !done)
      return fail(done.error().message);
    std::this_thread::sleep_for(std::chrono::nanoseconds(kPollPeriod.ns));
  }
  const Status ended = console.end({runtime::wall_now().ns});
  return ended ? Exit::done : fail(ended.error().message);
}

Exit run(const Arguments& arguments) {
  catch_stop_signals();
  if (arguments.list) return list();
  auto mapping = arguments.mapping.empty()
                     ? Result<station::JoystickMapping>(station::default_joystick_mapping())
                     : station::load_joystick_mapping(arguments.mapping);
  if (!mapping) return fail(mapping.error().message);
  auto port = station::JoystickPort::open();
  if (!port) return fail(port.error().message);
  auto bus = arguments.bus.open("joystick");
  if (!bus) return fail(bus.error().message);
  return drive(arguments, std::move(*mapping), **bus, **port);
}

}  // namespace

void add_joystick(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("joystick", "Drive a robot with a joystick or game pad");
  auto arguments = std::make_shared<Arguments>();
  command->add_option(
      "--mapping", arguments->mapping,
      "Mapping of sticks and buttons: YAML, or `crawler` (with arm and flippers); by default that "
      "of a game pad that only drives");
  command->add_flag("--list", arguments->list, "List the devices with the names of their axes and buttons");
  command->add_option("--robot", arguments->robot, "Robot to drive; by default the trainee's");
  command->add_option("--name", arguments->name, "Name of the operator: letters, digits, '_', '-'")
      ->check(CLI::Validator(station::operator_name_fault, ""))
      ->capture_default_str();
  arguments->bus.add_to(*command);
  command->footer(
      "Example: parhelion joystick --mapping crawler\n         parhelion joystick --mapping console.yaml\n\n"
      "By default: hold the left shoulder button (the dead-man), left stick drives and turns, right "
      "shoulder\n"
      "slows, start drives the next robot. Unplugging stops the robot.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools

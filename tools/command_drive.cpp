// parhelion drive: a keyboard in a terminal as a console.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "protocols/driving_timing.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/console/operator_console.hpp"
#include "server/station/console/terminal.hpp"
#include "tools/bus_options.hpp"
#include "tools/command.hpp"
#include "tools/consoles/keyboard_console.hpp"
#include "tools/stop_signal.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  KeyboardConsoleOptions options;
  BusOptions bus;
  double first_hold = 0.7, hold = 0.15;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion drive: %s\n", what.c_str());
  return Exit::failed;
}

void show(KeyboardConsole& console) {
  if (console.take_help()) std::printf("\n%s", station::keyboard_help());
  for (const std::string& news : console.view().take_news()) std::printf("\r\033[K%s\n", news.c_str());
  std::printf("\r\033[K%s", console.line(runtime::steady_now()).c_str());
  std::fflush(stdout);
}

Exit drive(KeyboardConsole& console) {
  auto terminal = station::RawTerminal::open(STDIN_FILENO);
  if (!terminal) return fail(terminal.error().message);
  if (const Status listening = console.listen(); !listening) return fail(listening.error().message);
  std::printf("%s", station::keyboard_help());
  std::string problem;
  while (!console.quit() && !stop_asked() && problem.empty()) {
    const auto bytes = (*terminal)->read(driving_timing::kCommandPeriod);
    const Status done =
        bytes ? console.turn(*bytes, runtime::steady_now(), {runtime::wall_now().ns}) : Status(bytes.error());
    if (!done) problem = done.error().message;
    show(console);
  }
  const SensorTime now{runtime::wall_now().ns};
  const Status ended = problem.empty() ? console.end(now) : console.lose(problem, now);
  std::printf("\n");
  if (!problem.empty()) return fail(problem);
  return ended ? Exit::done : fail(ended.error().message);
}

Exit run(Arguments& arguments) {
  catch_stop_signals();
  arguments.options.keys.first_hold = seconds(arguments.first_hold);
  arguments.options.keys.hold = seconds(arguments.hold);
  auto bus = arguments.bus.open("drive");
  if (!bus) return fail(bus.error().message);
  KeyboardConsole console(arguments.options, **bus);
  return drive(console);
}

}  // namespace

void add_drive(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("drive", "Drive a robot with the keyboard of this terminal");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("--robot", arguments->options.robot, "Robot to drive; by default the trainee's");
  command->add_option("--name", arguments->options.name, "Name of the operator: letters, digits, '_', '-'")
      ->check(CLI::Validator(station::operator_name_fault, ""))
      ->capture_default_str();
  command->add_option("--speed", arguments->options.keys.speed, "m/s at the highest speed step")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command->add_option("--yaw-rate", arguments->options.keys.yaw_rate, "rad/s at the highest speed step")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command
      ->add_option("--first-hold", arguments->first_hold,
                   "Seconds for which a key counts as held after its first press")
      ->check(CLI::Range(0.05, 2.0))
      ->capture_default_str();
  command->add_option("--hold", arguments->hold, "Seconds for which it counts as held after each repeat")
      ->check(CLI::Range(0.05, 1.0))
      ->capture_default_str();
  arguments->bus.add_to(*command);
  command->footer("Example: parhelion drive --robot trainee\n\n" + std::string(station::keyboard_help()));
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools

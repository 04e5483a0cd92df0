// parhelion joystick: a joystick or game pad as a console.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <thread>

#include "server/hmi/joystick_device.hpp"
#include "server/wall_clock.hpp"
#include "tools/command.hpp"
#include "tools/operator_view.hpp"
#include "tools/stop_signal.hpp"

namespace parhelion {
namespace {

constexpr Duration poll_period = milliseconds(5);

struct Arguments {
  std::string mapping, robot, name = "operator", url;
  bool list = false;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion joystick: %s\n", what.c_str());
  return Exit::failed;
}

Exit list() {
  auto port = JoystickPort::open();
  if (!port) return fail(port.error().message);
  const auto devices = (*port)->list();
  if (devices.empty()) std::printf("no joystick is plugged in\n");
  for (const JoystickName& device : devices) {
    std::printf("%s: axis 0 to %d, button 0 to %d%s\n", device.name.c_str(), device.axes - 1,
                device.buttons - 1, device.game_controller ? ", a game controller" : "");
  }
  for (const JoystickName& device : devices) {
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

class Stick {
 public:
  Stick(const Arguments& arguments, JoystickMapping mapping, Bus& bus, JoystickPort& port)
      : arguments_(arguments),
        port_(port),
        view_(bus),
        console_(bus, arguments.name, "joystick"),
        drive_(std::move(mapping)),
        period_(seconds(1 / drive_.mapping().rate)) {
    for (const MappedJoint& joint : drive_.mapping().joints) joints_.push_back(joint.joint);
  }

  Exit run() {
    if (const Status listening = view_.listen(); !listening) return fail(listening.error().message);
    while (!stop_asked()) {
      const Status done = turn();
      if (!done) return fail(done.error().message);
      std::this_thread::sleep_for(std::chrono::nanoseconds(poll_period.ns));
    }
    const Status ended = console_.end({wall_now().ns});
    return ended ? Exit::done : fail(ended.error().message);
  }

 private:
  Status turn() {
    const SensorTime stamp{wall_now().ns};
    if (Status updated = view_.update(); !updated) return updated;
    for (const std::string& news : view_.take_news()) say(news);
    console_.set_robots(view_.robots());
    const auto state = port_.poll(drive_.mapping().device);
    if (!state) return unplugged(stamp);
    if (!plugged_) {
      if (Status fits = check_mapping(drive_.mapping(), *state); !fits)
        return Error{port_.in_use() + ": " + fits.error().message};
      say(port_.in_use() + " is plugged in; release and hold '" + drive_.mapping().dead_man + "' to drive");
      drive_.restart();
      plugged_ = true;
    }
    const JoystickCommand command = drive_.command(*state);
    if (Status chosen = choose(command.next_robot, stamp); !chosen) return chosen;
    return send(command, stamp);
  }

  Status unplugged(SensorTime stamp) {
    if (!plugged_ && waiting_) return {};
    waiting_ = true;
    if (!plugged_) {
      say("waiting for a joystick" +
          (drive_.mapping().device.empty() ? "" : " '" + drive_.mapping().device + "'"));
      return {};
    }
    plugged_ = false;
    say("unplugged: the robot is stopped");
    const bool driving = console_.driven() != nullptr;
    last_robot_ = driving ? console_.driven()->name : "";
    return driving ? console_.lose("the joystick was unplugged", stamp) : Status{};
  }

  Status choose(bool next, SensorTime stamp) {
    if (console_.robots().empty()) return {};
    if (next) {
      drive_.restart();  // nobody drives off on a stick that is still pushed
      Status switched = console_.drive_next(stamp);
      if (switched) say("drives " + console_.driven()->name);
      return switched;
    }
    if (console_.driven() != nullptr) return {};
    const auto& robots = console_.robots();
    const std::string wanted = !last_robot_.empty() ? last_robot_ : arguments_.robot;
    const bool there = std::any_of(robots.begin(), robots.end(),
                                   [&](const DrivenRobot& robot) { return robot.name == wanted; });
    if (!there && !arguments_.robot.empty() && wanted == arguments_.robot)
      return console_.drive(wanted, stamp);
    Status driving = console_.drive(there ? wanted : std::string(robots.front().name), stamp);
    if (driving) say("drives " + console_.driven()->name);
    return driving;
  }

  Status send(const JoystickCommand& command, SensorTime stamp) {
    const WallTime now = steady_now();
    // The stop of a released dead-man does not wait for its turn.
    const bool released = armed_ && !command.armed;
    if (!released && now - sent_ < period_) return {};
    sent_ = now;
    const bool speaks = command.armed || released || now - armed_until_ < milliseconds(300);
    if (command.armed) armed_until_ = now;
    if (command.armed != armed_) say(command.armed ? "drives" : "released: stopped");
    armed_ = command.armed;
    if (!speaks) return console_.beat(stamp);
    if (Status sent = console_.command(command.twist, stamp); !sent) return sent;
    const bool joints = console_.driven() != nullptr && !console_.driven()->joints.empty();
    return joints ? console_.joints(joints_, command.joints, stamp) : Status{};
  }

  void say(const std::string& line) const {
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  }

  const Arguments& arguments_;
  JoystickPort& port_;
  OperatorView view_;
  OperatorConsole console_;
  JoystickDrive drive_;
  Duration period_;
  std::vector<std::string> joints_;
  std::string last_robot_;
  bool plugged_ = false, waiting_ = false, armed_ = false;
  WallTime sent_, armed_until_;
};

Exit run(const Arguments& arguments) {
  catch_stop_signals();
  if (arguments.list) return list();
  auto mapping = arguments.mapping.empty() ? Result<JoystickMapping>(default_joystick_mapping())
                                           : load_joystick_mapping(arguments.mapping);
  if (!mapping) return fail(mapping.error().message);
  auto port = JoystickPort::open();
  if (!port) return fail(port.error().message);
  auto bus = open_network_bus(arguments.url);
  if (!bus) return fail(bus.error().message);
  return Stick(arguments, std::move(*mapping), **bus, **port).run();
}

}  // namespace

void add_joystick(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("joystick", "Drive a robot with a joystick or game pad");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("--mapping", arguments->mapping,
                      "YAML: what its sticks and buttons mean; by default those of a game pad");
  command->add_flag("--list", arguments->list,
                    "What is plugged in, and what its axes and buttons are called");
  command->add_option("--robot", arguments->robot, "Whom to drive; by default the trainee's");
  command->add_option("--name", arguments->name, "Of the operator")->capture_default_str();
  command->add_option("--url", arguments->url, "LCM URL");
  command->footer(
      "Example: parhelion joystick --mapping console.yaml\n\n"
      "By default: hold the left shoulder button (the dead-man), left stick drives and turns, right "
      "shoulder\n"
      "slows, start drives the next robot. Unplugging stops the robot.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion

// parhelion drive: a keyboard in a terminal as a console.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "server/hmi/keyboard.hpp"
#include "server/hmi/terminal.hpp"
#include "server/wall_clock.hpp"
#include "tools/command.hpp"
#include "tools/operator_view.hpp"
#include "tools/stop_signal.hpp"

namespace parhelion {
namespace {

constexpr Duration period = milliseconds(50);         // of TELEOP while a key is held
constexpr Duration said_stopped = milliseconds(300);  // a stop is said this long: a message may be lost

struct Arguments {
  std::string robot, name = "operator", url;
  KeyboardOptions keys;
  double first_hold = 0.7, hold = 0.15;
};

Exit fail(const std::string& what) {
  std::fprintf(stderr, "parhelion drive: %s\n", what.c_str());
  return Exit::failed;
}

class Drive {
 public:
  Drive(const Arguments& arguments, Bus& bus)
      : arguments_(arguments), view_(bus), console_(bus, arguments.name, "keyboard"), keys_(arguments.keys) {}

  Exit run() {
    auto terminal = RawTerminal::open(STDIN_FILENO);
    if (!terminal) return fail(terminal.error().message);
    if (const Status listening = view_.listen(); !listening) return fail(listening.error().message);
    std::printf("%s", keyboard_help());
    std::string problem;
    while (!quit_ && !stop_asked() && problem.empty()) {
      const auto bytes = (*terminal)->read(period);
      const Status done = bytes ? turn(*bytes) : Status(bytes.error());
      if (!done) problem = done.error().message;
    }
    const SensorTime now{wall_now().ns};
    const Status ended = problem.empty() ? console_.end(now) : console_.lose(problem, now);
    std::printf("\n");
    if (!problem.empty()) return fail(problem);
    return ended ? Exit::done : fail(ended.error().message);
  }

 private:
  Status turn(const std::string& bytes) {
    const WallTime now = steady_now();
    for (const Key key : bytes.empty() ? reader_.idle() : reader_.feed(bytes)) {
      keys_.press(key, now);
      if (const Status done = act(key); !done) return done;
    }
    if (Status updated = view_.update(); !updated) return updated;
    if (now - last_ < period) return {};
    last_ = now;
    return send(now);
  }

  Status act(Key key) {
    const std::size_t joints = view_.joints().size();
    switch (key) {
      case Key::quit:
        quit_ = true;
        return {};
      case Key::help:
        std::printf("\n%s", keyboard_help());
        return {};
      case Key::stop:
        moved_ = steady_now();
        return {};
      case Key::next_robot:
        moved_ = steady_now();
        return console_.robots().empty() ? Status{} : console_.drive_next({wall_now().ns});
      case Key::next_joint:
        joint_ = joints > 0 ? (joint_ + 1) % joints : 0;
        return {};
      case Key::previous_joint:
        joint_ = joints > 0 ? (joint_ + joints - 1) % joints : 0;
        return {};
      default:
        return {};
    }
  }

  Status choose(SensorTime stamp) {
    console_.set_robots(view_.robots());
    if (console_.driven() != nullptr || console_.robots().empty()) return {};
    const std::string& wanted =
        arguments_.robot.empty() || chosen_ ? console_.robots().front().name : arguments_.robot;
    chosen_ = true;
    return console_.drive(std::string(wanted), stamp);
  }

  Status send(WallTime now) {
    const SensorTime stamp{wall_now().ns};
    if (Status chosen = choose(stamp); !chosen) return chosen;
    const Twist2 twist = keys_.twist(now);
    if (twist.vx != 0 || twist.wz != 0) moved_ = now;
    const bool speaks = now - moved_ < said_stopped;
    Status sent = speaks ? console_.command(twist, stamp) : console_.beat(stamp);
    if (sent) sent = send_joint(keys_.joint_speed(now), stamp);
    show(twist);
    return sent;
  }

  Status send_joint(double speed, SensorTime stamp) {
    const bool stops = joint_moved_ && speed == 0;
    joint_moved_ = speed != 0;
    if ((!joint_moved_ && !stops) || joint_ >= view_.joints().size()) return {};
    const Status sent = console_.joints({view_.joints()[joint_]}, {speed}, stamp);
    if (!sent) std::printf("\r\033[K%s\n", sent.error().message.c_str());
    return {};
  }

  void show(const Twist2& twist) {
    for (const std::string& news : view_.take_news()) std::printf("\r\033[K%s\n", news.c_str());
    const DrivenRobot* robot = console_.driven();
    const std::string joint = joint_ < view_.joints().size() ? "  joint " + view_.joints()[joint_] : "";
    std::printf("\r\033[K%s  %+.2f m/s %+.2f rad/s (goes out: %+.2f %+.2f)  speed %d/%d%s",
                robot != nullptr ? robot->name.c_str() : "no robot yet: is `parhelion serve` running?",
                twist.vx, twist.wz, view_.command().vx, view_.command().wz, keys_.step(),
                KeyboardDrive::steps, joint.c_str());
    std::fflush(stdout);
  }

  const Arguments& arguments_;
  OperatorView view_;
  OperatorConsole console_;
  KeyReader reader_;
  KeyboardDrive keys_;
  bool quit_ = false, chosen_ = false, joint_moved_ = false;
  std::size_t joint_ = 0;
  WallTime moved_, last_;
};

Exit run(Arguments& arguments) {
  catch_stop_signals();
  arguments.keys.first_hold = seconds(arguments.first_hold);
  arguments.keys.hold = seconds(arguments.hold);
  auto bus = open_network_bus(arguments.url);
  if (!bus) return fail(bus.error().message);
  return Drive(arguments, **bus).run();
}

}  // namespace

void add_drive(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("drive", "Drive a robot with the keyboard of this terminal");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("--robot", arguments->robot, "Whom to drive; by default the trainee's");
  command->add_option("--name", arguments->name, "Of the operator")->capture_default_str();
  command->add_option("--speed", arguments->keys.speed, "m/s at the highest step")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command->add_option("--yaw-rate", arguments->keys.yaw_rate, "rad/s at the highest step")
      ->check(CLI::Range(0.0, 10.0))
      ->capture_default_str();
  command
      ->add_option("--first-hold", arguments->first_hold,
                   "s that a key counts as held until the terminal repeats it")
      ->check(CLI::Range(0.05, 2.0))
      ->capture_default_str();
  command->add_option("--hold", arguments->hold, "s that it counts as held after each repeat")
      ->check(CLI::Range(0.05, 1.0))
      ->capture_default_str();
  command->add_option("--url", arguments->url, "LCM URL");
  command->footer("Example: parhelion drive --robot trainee\n\n" + std::string(keyboard_help()));
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion

#include "tools/consoles/keyboard_console.hpp"

#include <cstdio>
#include <utility>

#include "protocols/driving_timing.hpp"

namespace parhelion::tools {

KeyboardConsole::KeyboardConsole(const KeyboardConsoleOptions& options, Bus& bus)
    : options_(options), view_(bus), console_(bus, options.name, "keyboard"), keys_(options.keys) {}

Status KeyboardConsole::turn(std::string_view bytes, WallTime now, SensorTime stamp) {
  for (const station::Key key : bytes.empty() ? reader_.idle() : reader_.feed(bytes)) {
    keys_.press(key, now);
    if (Status done = act(key, now, stamp); !done) return done;
  }
  if (Status updated = view_.update(); !updated) return updated;
  if (now - last_ < driving_timing::kCommandPeriod) return {};
  last_ = now;
  return send(now, stamp);
}

Status KeyboardConsole::act(station::Key key, WallTime now, SensorTime stamp) {
  const std::size_t joints = view_.joints(driven_name()).size();
  switch (key) {
    case station::Key::quit:
      quit_ = true;
      return {};
    case station::Key::help:
      help_ = true;
      return {};
    case station::Key::stop:
      moved_ = now;
      return {};
    case station::Key::next_robot:
      moved_ = now;
      return console_.robots().empty() ? Status{} : console_.drive_next(stamp);
    case station::Key::next_joint:
      joint_ = joints > 0 ? (joint_ + 1) % joints : 0;
      return {};
    case station::Key::previous_joint:
      joint_ = joints > 0 ? (joint_ + joints - 1) % joints : 0;
      return {};
    default:
      return {};
  }
}

Status KeyboardConsole::choose(SensorTime stamp) {
  console_.set_robots(view_.robots());
  if (console_.driven() != nullptr || console_.robots().empty()) return {};
  const std::string wanted =
      options_.robot.empty() || chosen_ ? console_.robots().front().name : options_.robot;
  chosen_ = true;
  return console_.drive(wanted, stamp);
}

Status KeyboardConsole::send(WallTime now, SensorTime stamp) {
  if (Status chosen = choose(stamp); !chosen) return chosen;
  const Twist2 twist = keys_.twist(now);
  if (twist.vx != 0 || twist.wz != 0) moved_ = now;
  const bool speaks = now - moved_ < driving_timing::kStopDuration;
  Status sent = speaks ? console_.command(twist, stamp) : console_.beat(stamp);
  return sent ? send_joint(keys_.joint_speed(now), stamp) : sent;
}

Status KeyboardConsole::send_joint(double speed, SensorTime stamp) {
  const bool stops = joint_moved_ && speed == 0;
  joint_moved_ = speed != 0;
  if ((!joint_moved_ && !stops) || joint().empty()) return {};
  const Status sent = console_.joints({joint()}, {speed}, stamp);
  refused_ = sent ? "" : sent.error().message;
  return {};
}

bool KeyboardConsole::take_help() { return std::exchange(help_, false); }

std::string KeyboardConsole::driven_name() const {
  const station::DrivenRobot* robot = console_.driven();
  return robot != nullptr ? robot->name : std::string();
}

std::string KeyboardConsole::joint() const {
  const std::vector<std::string> joints = view_.joints(driven_name());
  return joint_ < joints.size() ? joints[joint_] : "";
}

std::string KeyboardConsole::line(WallTime now) const {
  const station::DrivenRobot* robot = console_.driven();
  if (!refused_.empty()) return refused_;
  const Twist2 twist = keys_.twist(now), applied = view_.command(driven_name());
  char text[160];
  std::snprintf(text, sizeof text, "  %+.2f m/s %+.2f rad/s (applied: %+.2f %+.2f)  speed %d/%d", twist.vx,
                twist.wz, applied.vx, applied.wz, keys_.step(), station::KeyboardDrive::kSteps);
  return (robot != nullptr ? robot->name : "no robot yet: is `parhelion serve` running?") + text +
         (joint().empty() ? "" : "  joint " + joint());
}

}  // namespace parhelion::tools

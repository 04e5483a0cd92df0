#include "tools/consoles/joystick_console.hpp"

#include <algorithm>
#include <utility>

#include "protocols/driving_timing.hpp"

namespace parhelion::tools {

JoystickConsole::JoystickConsole(JoystickConsoleOptions options, station::JoystickMapping mapping, Bus& bus,
                                 station::JoystickPort& port)
    : options_(std::move(options)),
      port_(port),
      view_(bus),
      console_(bus, options_.name, "joystick"),
      drive_(std::move(mapping)),
      period_(seconds(1 / drive_.mapping().rate)) {
  for (const station::MappedJoint& joint : drive_.mapping().joints) joints_.push_back(joint.joint);
}

Status JoystickConsole::turn(WallTime now, SensorTime stamp) {
  if (Status updated = view_.update(); !updated) return updated;
  for (const std::string& news : view_.take_news()) notify(news);
  console_.set_robots(view_.robots());
  const auto state = port_.poll(drive_.mapping().device);
  if (!state) return unplugged(stamp);
  if (!plugged_) {
    if (const Status fits = station::check_mapping(drive_.mapping(), *state); !fits)
      return Error{port_.in_use() + ": " + fits.error().message};
    notify(port_.in_use() + " is plugged in; release and hold '" + drive_.mapping().dead_man + "' to drive");
    drive_.restart();
    plugged_ = true;
  }
  const station::JoystickCommand command = drive_.command(*state);
  if (Status chosen = choose(command.next_robot, stamp); !chosen) return chosen;
  return send(command, now, stamp);
}

Status JoystickConsole::unplugged(SensorTime stamp) {
  if (!plugged_ && waiting_) return {};
  waiting_ = true;
  if (!plugged_) {
    const std::string& device = drive_.mapping().device;
    notify("waiting for a joystick" + (device.empty() ? "" : " '" + device + "'"));
    return {};
  }
  plugged_ = armed_ = false;
  notify("unplugged: the robot is stopped");
  const bool driving = console_.driven() != nullptr;
  last_robot_ = driving ? console_.driven()->name : "";
  return driving ? console_.lose("the joystick was unplugged", stamp) : Status{};
}

Status JoystickConsole::choose(bool next, SensorTime stamp) {
  if (console_.robots().empty()) return {};
  if (next) {
    drive_.restart();  // a stick that is still deflected must not start a motion
    Status switched = console_.drive_next(stamp);
    if (switched) notify("drives " + console_.driven()->name);
    return switched;
  }
  if (console_.driven() != nullptr) return {};
  const auto& robots = console_.robots();
  const std::string wanted = !last_robot_.empty() ? last_robot_ : options_.robot;
  const bool there = std::any_of(robots.begin(), robots.end(),
                                 [&](const station::DrivenRobot& robot) { return robot.name == wanted; });
  if (!there && !options_.robot.empty() && wanted == options_.robot) return console_.drive(wanted, stamp);
  Status driving = console_.drive(there ? wanted : std::string(robots.front().name), stamp);
  if (driving) notify("drives " + console_.driven()->name);
  return driving;
}

Status JoystickConsole::send(const station::JoystickCommand& command, WallTime now, SensorTime stamp) {
  // The stop after a released dead-man is sent at once.
  const bool released = armed_ && !command.armed;
  if (!released && now - sent_ < period_) return {};
  sent_ = now;
  const bool speaks = command.armed || released || now - armed_until_ < driving_timing::kStopDuration;
  if (command.armed) armed_until_ = now;
  if (command.armed != armed_) notify(command.armed ? "drives" : "dead-man released: stopped");
  armed_ = command.armed;
  if (!speaks) return console_.beat(stamp);
  if (Status sent = console_.command(command.twist, stamp); !sent) return sent;
  const bool joints = console_.driven() != nullptr && !console_.driven()->joints.empty();
  return joints ? console_.joints(joints_, command.joints, stamp) : Status{};
}

void JoystickConsole::notify(const std::string& line) const {
  if (options_.notify) options_.notify(line);
}

}  // namespace parhelion::tools

#include "server/station/console/operator_console.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>
#include <utility>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec_wire.hpp"
#include "protocols/driving_timing.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::station {
namespace {

constexpr int kStops = 3;  // repeated, since a single message may be lost

std::vector<std::string> names_of(const std::string& robots) {
  std::istringstream words(robots);
  return {std::istream_iterator<std::string>(words), {}};
}

}  // namespace

std::vector<DrivenRobot> robots_in(const WorldMessage& world) {
  std::vector<DrivenRobot> robots;
  const auto add = [&](DrivenRobot robot) {
    const auto same = [&](const DrivenRobot& known) { return known.name == robot.name; };
    if (std::none_of(robots.begin(), robots.end(), same)) robots.push_back(std::move(robot));
  };
  const std::vector<std::string> names = names_of(world.robot);
  for (const std::string& name : names) {
    const std::string& in_channels = names.size() == 1 ? std::string() : name;
    add({name, robot_channel(channel::kTeleop, in_channels), robot_channel(channel::kJointCmd, in_channels)});
  }
  for (const WorldMessage::Entry& body : world.bodies) {
    if (body.owner == BodyOwner::agent && body.kind == AgentKind::robot)
      add({body.entity, "MR_AGENT_" + body.entity + "_TELEOP", "MR_AGENT_" + body.entity + "_JOINT_CMD"});
  }
  return robots;
}

std::string operator_name_fault(const std::string& name) {
  if (wire::is_operator_name(name)) return {};
  return "an operator's name has 1 to " + std::to_string(kMaxOperatorName) +
         " letters, digits, '_' and '-', found '" + yaml::printable(name) + "'";
}

OperatorConsole::OperatorConsole(Bus& bus, std::string name, std::string console)
    : bus_(bus), name_(std::move(name)), console_(std::move(console)) {}

const DrivenRobot* OperatorConsole::driven() const {
  const auto found = std::find_if(robots_.begin(), robots_.end(),
                                  [&](const DrivenRobot& robot) { return robot.name == driven_; });
  return found == robots_.end() ? nullptr : &*found;
}

void OperatorConsole::set_robots(std::vector<DrivenRobot> robots) {
  robots_ = std::move(robots);
  if (driven() == nullptr) driven_.clear();
}

Status OperatorConsole::publish_status(OperatorStatus::State state, const std::string& text, SensorTime now) {
  last_published_ = now;
  encode(OperatorStatus{now, name_, driven_, state, wire::clipped(text)}, payload_);
  return bus_.publish(channel::kOperators, payload_);
}

Status OperatorConsole::stop(SensorTime now) {
  const DrivenRobot* robot = driven();
  if (robot == nullptr) return {};
  encode(TwistCommand{now, {}}, payload_);
  for (int i = 0; i < kStops; ++i) {
    if (Status sent = bus_.publish(robot->teleop, payload_); !sent) return sent;
  }
  return {};
}

Status OperatorConsole::drive(const std::string& robot, SensorTime now) {
  const auto found = std::find_if(robots_.begin(), robots_.end(),
                                  [&](const DrivenRobot& each) { return each.name == robot; });
  if (found == robots_.end()) {
    std::string known;
    for (const DrivenRobot& each : robots_) known += (known.empty() ? "" : ", ") + each.name;
    return Error{"no robot '" + robot + "'; there " +
                 (known.empty() ? "is no robot yet: is `parhelion serve` running?" : "are " + known)};
  }
  if (robot != driven_) {
    if (Status stopped = stop(now); !stopped) return stopped;
  }
  driven_ = robot;
  return publish_status(OperatorStatus::State::drives, console_, now);
}

Status OperatorConsole::drive_next(SensorTime now) {
  if (robots_.empty()) return drive("", now);
  const DrivenRobot* robot = driven();
  const std::size_t next =
      robot == nullptr ? 0 : (static_cast<std::size_t>(robot - robots_.data()) + 1) % robots_.size();
  return drive(std::string(robots_[next].name), now);
}

Status OperatorConsole::command(const Twist2& twist, SensorTime now) {
  const DrivenRobot* robot = driven();
  if (robot == nullptr) return {};
  if (Status published = beat(now); !published) return published;
  encode(TwistCommand{now, twist}, payload_);
  return bus_.publish(robot->teleop, payload_);
}

Status OperatorConsole::joints(const std::vector<std::string>& names, const std::vector<double>& velocities,
                               SensorTime now) {
  const DrivenRobot* robot = driven();
  if (robot == nullptr || names.empty()) return {};
  if (robot->joints.empty())
    return Error{"robot '" + robot->name + "': its joints cannot be moved from a console"};
  encode(Joints{now, names, {}, velocities, {}}, payload_);
  return bus_.publish(robot->joints, payload_);
}

Status OperatorConsole::beat(SensorTime now) {
  if (driven() == nullptr || now - last_published_ < driving_timing::kConsoleHeartbeat) return {};
  return publish_status(OperatorStatus::State::drives, console_, now);
}

Status OperatorConsole::lose(const std::string& why, SensorTime now) {
  const Status stopped = stop(now);
  const Status published = publish_status(OperatorStatus::State::lost, why, now);
  driven_.clear();
  return stopped ? published : stopped;
}

Status OperatorConsole::end(SensorTime now) {
  const Status stopped = stop(now);
  const Status published = publish_status(OperatorStatus::State::ended, console_, now);
  driven_.clear();
  return stopped ? published : stopped;
}

}  // namespace parhelion::station

// The emergency stop of TeleopDesk: active until it is reset, and requested from the server until it replies.
#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"
#include "server/station/teleop_desk.hpp"

namespace parhelion::station {
namespace {

constexpr int most_often = 10;  // times that the server is asked at that pace: then for a stop each tenth
constexpr std::size_t most_unanswered = 100;  // orders of others
constexpr const char* elsewhere = "another console";

}  // namespace

void TeleopDesk::hear(const EmergencyStopCommand& command) {
  const std::lock_guard lock(mutex_);
  if (options_.robot.empty() || (!command.robot.empty() && command.robot != options_.robot)) return;
  if (own_.contains(command.request)) return;
  if (others_.size() >= most_unanswered) others_.clear();  // the server does not reply
  others_[command.request] = command;
}

void TeleopDesk::hear(const Event& event) {
  const std::lock_guard lock(mutex_);
  if (event.kind != EventKind::command_accepted) return;
  for (auto& [robot, order] : orders_) order.answered = order.answered || order.request == event.request;
  const auto other = others_.find(event.request);
  if (other == others_.end()) return;
  obey(other->second);
  others_.erase(other);
}

/// The server has stopped or released the robot at somebody else's request: follow it here.
void TeleopDesk::obey(const EmergencyStopCommand& command) {
  const std::string& robot = options_.robot;
  const bool stop = command.engaged;
  if (stop == (held_.count(robot) > 0)) return;
  if (stop) {
    held_[robot] = elsewhere;
    for (auto& [id, page] : pages_) {
      if (page->robot() == robot) refuse(*page, page->halt(now()));
    }
  } else {
    held_.erase(robot);
  }
  orders_.erase(robot);  // done as requested
  tell_all(estop_text(robot, elsewhere, stop));
  audit(elsewhere, (stop ? "emergency stop of " : "resets the emergency stop of ") + robot);
  if (options_.stops_changed) options_.stops_changed(held());
}

Status TeleopDesk::say_stop(const TeleopRobot& robot) {
  encode(TwistCommand{options_.stamp(), {}}, payload_);
  if (Status sent = bus_.publish(robot.driven.teleop, payload_); !sent) return sent;
  if (robot.driven.joints.empty() || robot.joints.empty()) return {};
  Joints joints{options_.stamp(), {}, {}, std::vector<double>(robot.joints.size(), 0), {}};
  for (const TeleopJoint& joint : robot.joints) joints.names.push_back(joint.name);
  encode(joints, payload_);
  return bus_.publish(robot.driven.joints, payload_);
}

Status TeleopDesk::say_order(const std::string& robot, Order& order) {
  order.said = options_.now();
  const bool seldom = ++order.times > most_often && order.times % most_often != 0;
  EmergencyStopCommand command;
  command.stamp = options_.stamp();
  command.request = order.request;
  command.robot = robot;
  command.engaged = order.stop;
  encode(command, payload_);
  const Status asked = seldom ? Status{} : bus_.publish(options_.emergency_stops, payload_);
  const TeleopRobot* known = find(robot);
  if (!order.stop || known == nullptr) return asked;
  const Status stopped = say_stop(*known);
  return asked ? stopped : asked;
}

void TeleopDesk::repeat_orders(WallTime now) {
  for (auto& [robot, order] : orders_) {
    if (order.answered || (!order.stop && order.times >= most_often)) continue;
    if (now - order.said < driving_timing::emergency_stop_period) continue;
    static_cast<void>(say_order(robot, order));  // repeated soon
  }
}

Status TeleopDesk::hold(const std::string& robot, const std::string& by) {
  if (!robot.empty() && find(robot) == nullptr) return Error{"emergency stop: no robot '" + robot + "'"};
  if (robots_.empty()) return Error{"emergency stop: there is no robot yet"};
  Status all;
  bool news = false;
  for (const TeleopRobot& each : robots_) {
    const std::string& name = each.driven.name;
    if (!robot.empty() && name != robot) continue;
    for (auto& [id, page] : pages_) {
      if (page->robot() != name) continue;
      if (Status halted = page->halt(now()); !halted) all = halted;
    }
    if (held_.insert({name, by}).second) {
      news = true;
      orders_[name] = {true, next_request(), {}, 0, false};
      tell_all(estop_text(name, by, true));
    }
    if (Status said = say_order(name, orders_[name]); !said) all = said;
  }
  if (news) audit(by, "emergency stop" + (robot.empty() ? " of all" : " of " + robot));
  if (news && options_.stops_changed) options_.stops_changed(held());
  return all;
}

Status TeleopDesk::stop(const std::string& robot, const std::string& by) {
  const std::lock_guard lock(mutex_);
  return hold(robot, by);
}

Status TeleopDesk::reset(const std::string& robot, const std::string& by) {
  const std::lock_guard lock(mutex_);
  if (!robot.empty() && held_.count(robot) == 0)
    return Error{"no emergency stop of '" + robot + "' is active"};
  Status all;
  for (auto stop = held_.begin(); stop != held_.end();) {
    if (!robot.empty() && stop->first != robot) {
      ++stop;
      continue;
    }
    const std::string name = stop->first;
    stop = held_.erase(stop);
    orders_[name] = {false, next_request(), {}, 0, false};
    if (Status said = say_order(name, orders_[name]); !said) all = said;
    tell_all(estop_text(name, by, false));
    audit(by, "resets the emergency stop of " + name);
  }
  if (options_.stops_changed) options_.stops_changed(held());
  return all;
}

std::uint64_t TeleopDesk::next_request() {
  // Far from the counters of others: the server's reply must be to this request.
  const std::uint64_t request = static_cast<std::uint64_t>(options_.stamp().ns) + ++requests_;
  own_.insert(request);
  if (own_.size() > most_unanswered) own_.erase(own_.begin());
  return request;
}

std::vector<EmergencyStop> TeleopDesk::held() const {
  std::vector<EmergencyStop> all;
  for (const auto& [robot, by] : held_) all.push_back({robot, by});
  return all;
}

std::vector<EmergencyStop> TeleopDesk::stops() const {
  const std::lock_guard lock(mutex_);
  return held();
}

}  // namespace parhelion::station

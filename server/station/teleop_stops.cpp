// The emergency stop of TeleopService: active until it is reset, and requested from the server until it
// replies.
#include <algorithm>

#include "protocols/codec.hpp"
#include "protocols/driving_timing.hpp"
#include "server/station/teleop_service.hpp"

namespace parhelion::station {
namespace {

constexpr int kMaxAttempts = 10;  // times that the server is asked at that pace: then for a stop each tenth
constexpr std::size_t kMaxUnanswered = 100;  // requests of others
constexpr const char* kElsewhere = "another console";
constexpr const char* kServer = "the server";

}  // namespace

void TeleopService::handle(const EmergencyStopCommand& command) {
  const std::lock_guard lock(mutex_);
  if (options_.robots.empty() || (!command.robot.empty() && !is_trainees(command.robot))) return;
  if (own_requests_.contains(command.request)) return;
  if (requests_of_others_.size() >= kMaxUnanswered) requests_of_others_.clear();  // the server does not reply
  requests_of_others_[command.request] = command;
}

void TeleopService::handle(const Event& event) {
  const std::lock_guard lock(mutex_);
  const bool accepted = event.kind == EventKind::command_accepted;
  if (!accepted && event.kind != EventKind::command_refused) return;
  for (auto& [robot, request] : stop_requests_) {
    if (request.number != event.request) continue;
    const bool refused_release = !accepted && !request.stop;
    request.answered = request.answered || accepted;
    if (refused_release) stop_again(robot);
  }
  if (!accepted) return;
  const auto other = requests_of_others_.find(event.request);
  if (other == requests_of_others_.end()) return;
  for (const std::string& robot : options_.robots) {
    if (other->second.robot.empty() || other->second.robot == robot)
      apply_emergency_stop(robot, other->second.engaged);
  }
  requests_of_others_.erase(other);
}

/// The server has refused the release: the robot is still stopped, and everybody must see that. A release is
/// sent several times, and a later one may still be accepted: a new stop follows it.
void TeleopService::stop_again(const std::string& robot) {
  const std::string by = stop_requests_[robot].stopped_by;
  audit(kServer, "does not release " + robot);
  static_cast<void>(stop_locked(robot, by));  // repeated until the server replies
}

/// The server has stopped or released the robot at somebody else's request: follow it here.
void TeleopService::apply_emergency_stop(const std::string& robot, bool stop) {
  if (stop == (stopped_by_.count(robot) > 0)) return;
  if (stop) {
    stopped_by_[robot] = kElsewhere;
    for (auto& [id, teleop_client] : clients_) {
      if (teleop_client->robot() == robot) refuse(*teleop_client, teleop_client->halt(now()));
    }
  } else {
    stopped_by_.erase(robot);
  }
  stop_requests_.erase(robot);  // done as requested
  send_about(robot, estop_text(robot, kElsewhere, stop));
  audit(kElsewhere, (stop ? "emergency stop of " : "releases the emergency stop of ") + robot);
  if (options_.stops_changed) options_.stops_changed(active_stops());
}

Status TeleopService::send_stop(const TeleopRobot& robot) {
  encode(TwistCommand{options_.stamp(), {}}, payload_);
  if (Status sent = bus_.publish(robot.driven.teleop, payload_); !sent) return sent;
  if (robot.driven.joints.empty() || robot.joints.empty()) return {};
  Joints joints{options_.stamp(), {}, {}, std::vector<double>(robot.joints.size(), 0), {}};
  for (const TeleopJoint& joint : robot.joints) joints.names.push_back(joint.name);
  encode(joints, payload_);
  return bus_.publish(robot.driven.joints, payload_);
}

Status TeleopService::send_stop_request(const std::string& robot, StopRequest& request) {
  request.sent = options_.now();
  const bool seldom = ++request.times > kMaxAttempts && request.times % kMaxAttempts != 0;
  EmergencyStopCommand command;
  command.stamp = options_.stamp();
  command.request = request.number;
  command.robot = robot;
  command.engaged = request.stop;
  encode(command, payload_);
  const Status asked = seldom ? Status{} : bus_.publish(options_.emergency_stops, payload_);
  const TeleopRobot* known = find(robot);
  if (!request.stop || known == nullptr) return asked;
  const Status stopped = send_stop(*known);
  return asked ? stopped : asked;
}

void TeleopService::repeat_stop_requests(WallTime now) {
  for (auto& [robot, request] : stop_requests_) {
    if (request.answered || (!request.stop && request.times >= kMaxAttempts)) continue;
    if (now - request.sent < driving_timing::kEmergencyStopPeriod) continue;
    static_cast<void>(send_stop_request(robot, request));  // repeated soon
  }
}

Status TeleopService::stop_locked(const std::string& robot, const std::string& by) {
  const std::vector<std::string> names = names_to_stop(robot);
  if (names.empty())
    return Error{"emergency stop: " + (robot.empty() ? "there is no robot yet" : "no robot '" + robot + "'")};
  Status all;
  bool news = false;
  for (const std::string& name : names) {
    for (auto& [id, teleop_client] : clients_) {
      if (teleop_client->robot() != name) continue;
      if (Status halted = teleop_client->halt(now()); !halted) all = halted;
    }
    if (stopped_by_.insert({name, by}).second) {
      news = true;
      stop_requests_[name] = {true, {}, next_request(), {}, 0, false};
      send_about(name, estop_text(name, by, true));
    }
    if (Status sent = send_stop_request(name, stop_requests_[name]); !sent) all = sent;
  }
  if (news) audit(by, "emergency stop" + (robot.empty() ? " of all" : " of " + robot));
  if (news && options_.stops_changed) options_.stops_changed(active_stops());
  return all;
}

bool TeleopService::is_trainees(const std::string& robot) const {
  return std::find(options_.robots.begin(), options_.robots.end(), robot) != options_.robots.end();
}

/// The trainees' robots can be stopped before the first message of a server that has just started.
std::vector<std::string> TeleopService::names_to_stop(const std::string& robot) const {
  std::vector<std::string> names;
  for (const TeleopRobot& each : robots_) names.push_back(each.driven.name);
  for (const std::string& each : options_.robots)
    if (find(each) == nullptr) names.push_back(each);
  if (!robot.empty()) std::erase_if(names, [&](const std::string& name) { return name != robot; });
  return names;
}

Status TeleopService::stop(const std::string& robot, const std::string& by) {
  const std::lock_guard lock(mutex_);
  return stop_locked(robot, by);
}

Status TeleopService::release_locked(const std::string& robot, const std::string& by) {
  if (!robot.empty() && stopped_by_.count(robot) == 0)
    return Error{"no emergency stop of '" + robot + "' is active"};
  Status all;
  for (auto stop = stopped_by_.begin(); stop != stopped_by_.end();) {
    if (!robot.empty() && stop->first != robot) {
      ++stop;
      continue;
    }
    const auto [name, presser] = *stop;
    stop = stopped_by_.erase(stop);
    stop_requests_[name] = {false, presser, next_request(), {}, 0, false};
    if (Status sent = send_stop_request(name, stop_requests_[name]); !sent) all = sent;
    send_about(name, estop_text(name, by, false));
    audit(by, "releases the emergency stop of " + name);
  }
  if (options_.stops_changed) options_.stops_changed(active_stops());
  return all;
}

Status TeleopService::release_stop(const std::string& robot, const std::string& by) {
  const std::lock_guard lock(mutex_);
  return release_locked(robot, by);
}

Status TeleopService::release_own_stop(const std::string& robot, const std::string& by) {
  const std::lock_guard lock(mutex_);
  if (stopped_by_.empty()) return Error{"no emergency stop is active"};
  for (const auto& [name, presser] : stopped_by_) {
    if ((robot.empty() || robot == name) && presser != by)
      return Error{"the emergency stop of '" + name + "' was pressed by " + presser +
                   "; an instructor must release it"};
  }
  return release_locked(robot, by);
}

std::uint64_t TeleopService::next_request() {
  // Far from the counters of others: the server's reply must be to this request.
  const std::uint64_t request = static_cast<std::uint64_t>(options_.stamp().ns) + ++requests_;
  own_requests_.insert(request);
  if (own_requests_.size() > kMaxUnanswered) own_requests_.erase(own_requests_.begin());
  return request;
}

std::vector<EmergencyStop> TeleopService::active_stops() const {
  std::vector<EmergencyStop> all;
  for (const auto& [robot, by] : stopped_by_) all.push_back({robot, by});
  return all;
}

std::vector<EmergencyStop> TeleopService::stops() const {
  const std::lock_guard lock(mutex_);
  return active_stops();
}

}  // namespace parhelion::station

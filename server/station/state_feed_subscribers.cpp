// Messages that pages get without a request: the current state when a page is opened, then periodic updates.
#include <algorithm>
#include <cmath>

#include "protocols/driving_timing.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/operator_name.hpp"
#include "server/station/people_json.hpp"
#include "server/station/state_feed.hpp"

namespace parhelion::station {
namespace {

constexpr Duration kSecondPeriod = seconds(1.0), kHalfPeriod = milliseconds(500),
                   kQuarterPeriod = milliseconds(250);
constexpr double kShownAhead = 2.0;  // s of predicted motion
constexpr int kPointsAhead = 8;
constexpr std::size_t kMaxPlans = 200;  // more would be unreadable

bool due(WallTime& next, WallTime now, Duration period) {
  if (now < next) return false;
  next = now + period;
  return true;
}

/// Extrapolates the present motion along its circle.
std::vector<Eigen::Vector2d> ahead(const WorldMessage::Entry& body) {
  Eigen::Vector2d p = body.T_map_body.translation().head<2>(), v = body.velocity.head<2>();
  std::vector<Eigen::Vector2d> points{p};
  constexpr double dt = kShownAhead / kPointsAhead;
  const Eigen::Rotation2Dd half_turn(body.rotation_rate.z() * dt / 2);
  for (int i = 0; i < kPointsAhead; ++i) {
    v = half_turn * v;
    p += dt * v;
    v = half_turn * v;
    points.push_back(p);
  }
  return points;
}

bool goes_by_itself(const WorldMessage::Entry& body) {
  return body.owner == BodyOwner::real_robot ||
         (body.owner == BodyOwner::agent &&
          (body.kind == AgentKind::robot || body.kind == AgentKind::person));
}

}  // namespace

void StateFeed::open(std::shared_ptr<WebClient> client) {
  subscribers_.open(std::move(client));
  greet(subscribers_.all().back());
}

void StateFeed::greet(Subscriber& subscriber) {
  const auto send = [&](std::string text, int slot = WebClient::kInOrder) {
    subscriber.client->send(shared_text(std::move(text)), false, slot);
  };
  send(hello(subscriber.client->who()));
  send(zones_json(configuration_->scenario.zones));
  if (model_version_ > 0) send(model_json(model_version_));
  if (table_.number() != 0 && !table_.parts().empty()) send(entities());
  const std::vector<Event> events(events_.begin(), events_.end());
  send(events_json(events, start()));
  greet_about_robot(subscriber);
  if (robots_.size() > 1) send(robots_text(), send_slot::kRobots);
  send(control_json(control()), send_slot::kControl);
  subscriber.world_due = {};
  send_operators();
}

void StateFeed::greet_about_robot(const Subscriber& subscriber) {
  const RobotFeed& robot = robots_[subscriber.robot];
  const auto send = [&](std::string text, int slot) {
    subscriber.client->send(shared_text(std::move(text)), false, slot);
  };
  send(score_json(robot.board, start(), now()), send_slot::kScore);
  send(status_text(robot), send_slot::kStatus);
  if (robot.pose_known) send(pose_json(robot.pose), send_slot::kPose);
  if (robot.info.stamp.ns != 0) send(injection_json(robot.info), send_slot::kInjection);
}

void StateFeed::subscribe(std::uint64_t client, const Subscription& wanted) {
  Subscriber* subscriber = subscribers_.find(client);
  if (subscriber == nullptr) return;
  subscriber->wants = wanted;
  const std::size_t robot = configuration_->find_robot(wanted.robot).value_or(0);
  if (std::exchange(subscriber->robot, robot) != robot) greet_about_robot(*subscriber);
}

std::string StateFeed::hello(const Identity& who) const {
  HelloFields hello_fields = options_.hello_fields;
  hello_fields.start = start();
  hello_fields.now = runtime::wall_now();
  return hello_json(*configuration_, who, hello_fields);
}

std::string StateFeed::entities() const {
  return entities_json(
      table_, [&](const std::string& entity, const std::string& part) { return shapes_.find(entity, part); },
      [&](const std::string& entity) {
        const AgentDefinition* definition = shapes_.definition(entity);
        return definition == nullptr ? std::string() : definition->model;
      });
}

std::string StateFeed::robots_text() const {
  std::vector<RobotLine> lines;
  for (const RobotFeed& robot : robots_) {
    lines.push_back({robot.name, robot.pose_known && robot.pose.state == SlamState::tracking,
                     robot.info.stamp.ns != 0 && robot.info.live, robot.info.reason, std::nullopt});
    if (robot.board.graded()) lines.back().score = robot.board.score();
  }
  return robots_json(lines);
}

std::string StateFeed::status_text(const RobotFeed& robot) const {
  ServerStatus shown = status_;
  if (!bus_error_.empty())
    shown.notes.emplace_back("bus", "the base station receives nothing: " + bus_error_);
  return status_json(shown, robot.sensors.states(options_.clock()));
}

ControlState StateFeed::control() const {
  ControlState state;
  if (options_.control) state = options_.control();
  state.recorded = recorded();
  if (state.position < 0) state.position = start_ ? std::max(0.0, t(now())) : 0;
  state.frozen = placed_.frozen();
  state.estop = options_.stopped && options_.stopped();
  return state;
}

void StateFeed::send_world(WallTime now) {
  auto& all = subscribers_.all();
  if (std::none_of(all.begin(), all.end(),
                   [&](const Subscriber& subscriber) { return now >= subscriber.world_due; }))
    return;
  if (!read_world()) return;
  if (!table_.fits(world_) && due(table_due_, now, kQuarterPeriod)) {
    table_.renew(world_);
    subscribers_.send_to_all(entities());
  }
  if (table_.number() == 0) return;
  const auto wants_scans = [](const Subscriber& subscriber) { return !subscriber.wants.agent_scans.empty(); };
  if (std::any_of(all.begin(), all.end(), wants_scans)) agents_.take(world_);
  const double seconds_in = t(SimulationTime{world_.stamp.ns});
  SharedText frames[2];  // by whether injection is suspended
  for (Subscriber& subscriber : all) {
    if (now < subscriber.world_due) continue;
    const bool suspended = robots_[subscriber.robot].injection_suspended();
    SharedText& frame = frames[suspended ? 1 : 0];
    if (!frame) frame = shared_text(table_.frame(world_, seconds_in, suspended));
    // A little early, so that worlds at exactly this rate are all sent.
    subscriber.world_due = now + seconds(0.75 / subscriber.wants.world_hz);
    subscriber.client->send(frame, true, send_slot::kWorld);
  }
}

void StateFeed::send_plans() {
  if (!read_world()) return;
  std::vector<EntityPlan> plans;
  const std::string* last = nullptr;
  for (const WorldMessage::Entry& body : world_.bodies) {
    if (plans.size() >= kMaxPlans) break;
    if (last != nullptr && *last == body.entity) continue;  // only an entity's first body counts
    last = &body.entity;
    if (!goes_by_itself(body)) continue;
    if (body.velocity.head<2>().norm() > 0.05) plans.push_back({body.entity, "predicted", ahead(body)});
    const AgentDefinition* agent = placed_.find(body.entity);
    if (agent == nullptr || agent->behaviour.waypoints.empty()) continue;
    const bool patrol = agent->behaviour.kind == BehaviourKind::patrol;
    if (!patrol && agent->behaviour.kind != BehaviourKind::go) continue;
    plans.push_back({body.entity, "path", agent->behaviour.waypoints});
    if (patrol) plans.back().points.push_back(agent->behaviour.waypoints.front());
  }
  subscribers_.send_to_all(plans_json(plans), send_slot::kPlans);
}

void StateFeed::send_people() {
  if (!read_world()) return;
  const bool anybody = !world_.persons.empty();
  if (std::exchange(people_shown_, anybody) || anybody)
    subscribers_.send_to_all(people_json(world_), send_slot::kPeople);
}

void StateFeed::forget_silent_operators(WallTime now) {
  const auto gone = std::erase_if(operators_, [&](const auto& each) {
    return now - each.second.second > driving_timing::kOperatorShown;
  });
  operators_changed_ = operators_changed_ || gone > 0;
}

/// People see each other's real names.
void StateFeed::send_operators() const {
  std::vector<OperatorStatus> statuses;
  for (const auto& [name, status] : operators_) {
    statuses.push_back(status.first);
    for (const Subscriber& subscriber : subscribers_.all()) {
      if (operator_name(subscriber.client->who()) == name)
        statuses.back().name = subscriber.client->who().name;
    }
  }
  subscribers_.send_to_all(operators_json(statuses), send_slot::kOperators);
}

void StateFeed::look(WallTime now) {
  forget_silent_operators(now);
  if (subscribers_.empty()) return;
  if (!new_events_.empty()) subscribers_.send_to_all(events_json(std::exchange(new_events_, {}), start()));
  const bool second = due(second_, now, kSecondPeriod), half = due(half_, now, kHalfPeriod);
  if (std::exchange(operators_changed_, false)) send_operators();
  for (std::size_t i = 0; i < robots_.size(); ++i) look_at_robot(i, second, half);
  if (half && robots_.size() > 1) subscribers_.send_to_all(robots_text(), send_slot::kRobots);
  ControlState state = control();
  const std::string text = control_json(state);
  state.position = 0;
  std::string without_position = control_json(state);
  if (half || without_position != sent_control_) subscribers_.send_to_all(text, send_slot::kControl);
  sent_control_ = std::move(without_position);
  if (!due(quarter_, now, kQuarterPeriod)) return;
  send_plans();
  send_people();
  for (std::size_t i = 0; i < robots_.size(); ++i) send_readings(i);
}

void StateFeed::look_at_robot(std::size_t index, bool second, bool half) {
  RobotFeed& robot = robots_[index];
  if (std::exchange(robot.score_changed, false) || (second && robot.board.graded()))
    subscribers_.send_to_robot(index, score_json(robot.board, start(), now()), send_slot::kScore);
  if (std::exchange(robot.injection_changed, false) || (half && robot.info.stamp.ns != 0))
    subscribers_.send_to_robot(index, injection_json(robot.info), send_slot::kInjection);
  if (std::exchange(robot.pose_changed, false) || (half && robot.pose_known))
    subscribers_.send_to_robot(index, pose_json(robot.pose), send_slot::kPose);
  if (second) subscribers_.send_to_robot(index, status_text(robot), send_slot::kStatus);
}

void StateFeed::send_readings(std::size_t index) {
  RobotFeed& robot = robots_[index];
  if (robot.joints)
    subscribers_.send_to_robot(index, joints_json(robot.name, *robot.joints), send_slot::kJoints);
  if (robot.hazard)
    subscribers_.send_to_robot(index,
                               hazard_json(*robot.hazard, t(robot.sensors.to_server(robot.hazard->stamp))),
                               send_slot::kHazard);
  robot.joints.reset();
  robot.hazard.reset();
}

}  // namespace parhelion::station

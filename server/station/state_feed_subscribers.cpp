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
  subscribers().open(std::move(client));
  note_pages();
  place(subscribers().all().back());
  greet(subscribers().all().back());
}

/// Decides what it is shown.
void StateFeed::place(Subscriber& subscriber) {
  std::vector<std::string> drives;
  const auto known = operators_.find(operator_name(subscriber.client->who()));
  if (known != operators_.end()) {
    const OperatorStatus& status = known->second.status;
    const AgentDefinition* agent = placed_.find(status.robot);
    if (status.state == OperatorStatus::State::drives && agent != nullptr) drives.push_back(agent->name);
  }
  const std::string before = subscriber.view;
  audience_.place(subscriber, drives);
  if (subscriber.view != before) subscriber.world_due = {};
}

void StateFeed::greet(Subscriber& subscriber) {
  const auto send = [&](const Audience::Make& make, int slot = WebClient::kInOrder) {
    audience_.send_to(subscriber, make, slot);
  };
  send([&](const View& /*any*/) { return hello(subscriber.client->who()); });
  send([&](const View& view) { return zones_text(view); });
  if (model_version_ > 0) send([&](const View& /*any*/) { return model_json(model_version_); });
  send([&](const View& view) { return view.table.parts().empty() ? std::string() : entities(view); });
  const std::vector<Event> events(events_.begin(), events_.end());
  send([&](const View& view) { return events_text(events, view); });
  greet_about_robot(subscriber);
  if (robots_.size() > 1) send([&](const View& view) { return robots_text(view); }, send_slot::kRobots);
  send([&](const View& /*any*/) { return control_json(control()); }, send_slot::kControl);
  subscriber.world_due = {};
  send_operators();
}

void StateFeed::greet_about_robot(const Subscriber& subscriber) {
  const RobotFeed& robot = robots_[subscriber.robot];
  const auto send = [&](const Audience::Make& make, int slot) { audience_.send_to(subscriber, make, slot); };
  send([&](const View& /*any*/) { return score_json(robot.board, start(), now()); }, send_slot::kScore);
  send([&](const View& view) { return status_text(robot, view); }, send_slot::kStatus);
  if (robot.pose_known) send([&](const View& /*any*/) { return pose_json(robot.pose); }, send_slot::kPose);
  if (robot.info.stamp.ns != 0)
    send([&](const View& view) { return injection_text(robot, view); }, send_slot::kInjection);
}

void StateFeed::subscribe(std::uint64_t client, const Subscription& wanted) {
  Subscriber* subscriber = subscribers().find(client);
  if (subscriber == nullptr) return;
  subscriber->wants = wanted;
  const std::size_t robot = configuration_->find_robot(wanted.robot).value_or(0);
  if (std::exchange(subscriber->robot, robot) == robot) return;
  place(*subscriber);
  audience_.send_to(*subscriber, [&](const View& view) {
    return view.table.parts().empty() ? std::string() : entities(view);
  });
  greet_about_robot(*subscriber);
}

std::string StateFeed::zones_text(const View& view) const {
  return zones_json(view.trainee ? view.trainee->zones() : configuration_->scenario.zones);
}

std::string StateFeed::events_text(const std::vector<Event>& events, const View& view) const {
  std::vector<Event> shown;
  for (const Event& event : events)
    if (auto visible = view.event(event)) shown.push_back(*std::move(visible));
  return view.trainee && shown.empty() ? std::string() : events_json(shown, start());
}

std::string StateFeed::injection_text(const RobotFeed& robot, const View& view) const {
  ScanInfo visible = robot.info;
  visible.reason = view.text(visible.reason);
  return injection_json(visible);
}

std::string StateFeed::hello(const Identity& who) const {
  HelloFields hello_fields = options_.hello_fields;
  hello_fields.start = start();
  hello_fields.now = runtime::wall_now();
  return hello_json(*configuration_, who, hello_fields);
}

std::string StateFeed::entities(const View& view) const {
  return entities_json(
      view.table,
      [&](const std::string& name, const std::string& part) {
        return shapes_.find(view.entity_of(name), part);
      },
      [&](const std::string& name) {
        const AgentDefinition* definition = shapes_.definition(view.entity_of(name));
        return definition == nullptr ? std::string() : definition->model;
      });
}

/// Scores of the others are not a trainee's business.
std::string StateFeed::robots_text(const View& view) const {
  std::vector<RobotLine> lines;
  for (const RobotFeed& robot : robots_) {
    lines.push_back({robot.name, robot.pose_known && robot.pose.state == SlamState::tracking,
                     robot.sensors.silence_of(channel::kPoseCov, options_.clock()),
                     robot.info.stamp.ns != 0 && robot.info.live, view.text(robot.info.reason),
                     std::nullopt});
    const bool visible = !view.trainee || view.trainee->robots().front() == robot.name;
    if (robot.board.graded() && visible) lines.back().score = robot.board.score();
  }
  return robots_json(lines);
}

/// The server's figures and notes count and name what a trainee has not sensed.
std::string StateFeed::status_text(const RobotFeed& robot, const View& view) const {
  ServerStatus shown = view.trainee ? ServerStatus() : status_;
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
  state.clock = Duration{looked_.ns}.seconds();
  return state;
}

/// The world as the view's pages know it, and its table.
void StateFeed::update(View& view, WallTime now) {
  if (view.trainee) {
    view.world = view.trainee->world(world_);
  } else {
    view.world.message = world_;
  }
  view.frames[0] = view.frames[1] = {};
  if (view.table.fits(view.world.message) || !due(view.table_due, now, kQuarterPeriod)) return;
  view.table.renew(view.world.message);
  audience_.send([&](const View& each) { return &each == &view ? entities(view) : std::string(); });
}

void StateFeed::send_world(WallTime now) {
  auto& all = subscribers().all();
  const auto is_due = [&](const Subscriber& subscriber) { return now >= subscriber.world_due; };
  if (std::none_of(all.begin(), all.end(), is_due) || !read_world()) return;
  std::vector<const View*> updated;
  const auto wants_scans = [](const Subscriber& subscriber) { return !subscriber.wants.agent_scans.empty(); };
  if (std::any_of(all.begin(), all.end(), wants_scans)) agents_.take(world_);
  const double seconds_in = t(SimulationTime{world_.stamp.ns});
  for (Subscriber& subscriber : all) {
    if (!is_due(subscriber)) continue;
    View& view = audience_.view_of(subscriber);
    if (std::find(updated.begin(), updated.end(), &view) == updated.end()) {
      update(view, now);
      updated.push_back(&view);
    }
    if (view.table.parts().empty()) continue;
    const bool suspended = robots_[subscriber.robot].injection_suspended();
    SharedText& frame = view.frames[suspended ? 1 : 0];
    if (!frame) {
      frame = shared_text(
          view.table.frame(view.world.message, seconds_in, suspended, [&](const std::string& name) {
            const auto thing = view.world.things.find(name);
            return thing != view.world.things.end() && !thing->second.now;
          }));
    }
    // A little early, so that worlds at exactly this rate are all sent.
    subscriber.world_due = now + seconds(0.75 / subscriber.wants.world_hz);
    subscriber.client->send(frame, true, send_slot::kWorld);
  }
}

/// A trainee is sent the motion of visible things, and never where they will go.
std::string StateFeed::plans_text(const View& view) const {
  std::vector<EntityPlan> plans;
  const std::string* last = nullptr;
  for (const WorldMessage::Entry& body : view.world.message.bodies) {
    if (plans.size() >= kMaxPlans) break;
    if (last != nullptr && *last == body.entity) continue;  // only an entity's first body counts
    last = &body.entity;
    if (!goes_by_itself(body)) continue;
    if (body.velocity.head<2>().norm() > 0.05) plans.push_back({body.entity, "predicted", ahead(body)});
    const AgentDefinition* agent = view.trainee ? nullptr : placed_.find(body.entity);
    if (agent == nullptr || agent->behaviour.waypoints.empty()) continue;
    const bool patrol = agent->behaviour.kind == BehaviourKind::patrol;
    if (!patrol && agent->behaviour.kind != BehaviourKind::go) continue;
    plans.push_back({body.entity, "path", agent->behaviour.waypoints});
    if (patrol) plans.back().points.push_back(agent->behaviour.waypoints.front());
  }
  return plans_json(plans);
}

void StateFeed::send_people() {
  if (!read_world()) return;
  const bool anybody = !world_.persons.empty();
  if (std::exchange(people_shown_, anybody) || anybody)
    audience_.send([&](const View& /*all*/) { return people_json(world_); }, send_slot::kPeople);
}

void StateFeed::forget_silent_operators(WallTime now) {
  const auto gone = std::erase_if(
      operators_, [&](const auto& each) { return now - each.second.last > driving_timing::kOperatorShown; });
  operators_changed_ = operators_changed_ || gone > 0;
}

/// People see each other's real names.
std::string StateFeed::operators_text(const View& view) const {
  std::vector<OperatorStatus> statuses;
  for (const auto& [name, shown] : operators_) {
    if (!view.may_follow(shown.status.robot)) continue;
    statuses.push_back(shown.status);
    for (const Subscriber& subscriber : audience_.subscribers().all()) {
      if (operator_name(subscriber.client->who()) == name)
        statuses.back().name = subscriber.client->who().name;
    }
  }
  return operators_json(statuses);
}

/// Who drives a robot is shown what that senses.
void StateFeed::send_operators() {
  for (Subscriber& subscriber : subscribers().all()) place(subscriber);
  audience_.send([&](const View& view) { return operators_text(view); }, send_slot::kOperators);
}

void StateFeed::look(WallTime now) {
  looked_ = now;
  note_pages();
  forget_silent_operators(now);
  look_from_agents(now);
  if (subscribers().empty()) return;
  if (!new_events_.empty()) {
    const std::vector<Event> events = std::exchange(new_events_, {});
    audience_.send([&](const View& view) { return events_text(events, view); });
  }
  const bool second = due(second_, now, kSecondPeriod), half = due(half_, now, kHalfPeriod);
  if (std::exchange(operators_changed_, false)) send_operators();
  for (std::size_t i = 0; i < robots_.size(); ++i) look_at_robot(i, second, half);
  if (half && robots_.size() > 1)
    audience_.send([&](const View& view) { return robots_text(view); }, send_slot::kRobots);
  ControlState state = control();
  const std::string text = control_json(state);
  state.position = state.clock = 0;
  std::string without_times = control_json(state);
  if (half || without_times != sent_control_)
    audience_.send([&](const View& /*all*/) { return text; }, send_slot::kControl);
  sent_control_ = std::move(without_times);
  if (!due(quarter_, now, kQuarterPeriod)) return;
  audience_.send([&](const View& view) { return plans_text(view); }, send_slot::kPlans);
  audience_.send([&](const View& view) { return known_json(view.world, start()); }, send_slot::kKnown);
  send_people();
  for (std::size_t i = 0; i < robots_.size(); ++i) send_readings(i);
}

void StateFeed::look_at_robot(std::size_t index, bool second, bool half) {
  RobotFeed& robot = robots_[index];
  if (std::exchange(robot.score_changed, false) || (second && robot.board.graded()))
    audience_.send_to_robot(
        index, [&](const View& /*all*/) { return score_json(robot.board, start(), now()); },
        send_slot::kScore);
  if (std::exchange(robot.injection_changed, false) || (half && robot.info.stamp.ns != 0))
    audience_.send_to_robot(
        index, [&](const View& view) { return injection_text(robot, view); }, send_slot::kInjection);
  if (std::exchange(robot.pose_changed, false) || (half && robot.pose_known))
    audience_.send_to_robot(
        index, [&](const View& /*all*/) { return pose_json(robot.pose); }, send_slot::kPose);
  if (second)
    audience_.send_to_robot(
        index, [&](const View& view) { return status_text(robot, view); }, send_slot::kStatus);
}

void StateFeed::send_readings(std::size_t index) {
  RobotFeed& robot = robots_[index];
  if (robot.joints)
    audience_.send_to_robot(
        index, [&](const View& /*all*/) { return joints_json(robot.name, *robot.joints); },
        send_slot::kJoints);
  if (robot.hazard) {
    const double read = t(robot.sensors.to_server(robot.hazard->stamp));
    audience_.send_to_robot(
        index, [&](const View& /*all*/) { return hazard_json(*robot.hazard, read); }, send_slot::kHazard);
  }
  robot.joints.reset();
  robot.hazard.reset();
}

}  // namespace parhelion::station

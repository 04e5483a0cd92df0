// Messages that pages get without a request: the current state when a page is opened, then periodic updates.
#include <algorithm>
#include <cmath>

#include "protocols/driving_timing.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/operator_name.hpp"
#include "server/station/state_feed.hpp"

namespace parhelion::station {
namespace {

constexpr Duration second_period = seconds(1.0), half_period = milliseconds(500),
                   quarter_period = milliseconds(250);
constexpr double shown_ahead = 2.0;  // s of predicted motion
constexpr int points_ahead = 8;
constexpr std::size_t most_plans = 200;  // more would be unreadable

bool due(WallTime& next, WallTime now, Duration period) {
  if (now < next) return false;
  next = now + period;
  return true;
}

/// Extrapolates the present motion along its circle.
std::vector<Eigen::Vector2d> ahead(const WorldMessage::Entry& body) {
  Eigen::Vector2d p = body.T_map_body.translation().head<2>(), v = body.velocity.head<2>();
  std::vector<Eigen::Vector2d> points{p};
  constexpr double dt = shown_ahead / points_ahead;
  const Eigen::Rotation2Dd half_turn(body.rotation_rate.z() * dt / 2);
  for (int i = 0; i < points_ahead; ++i) {
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
  pages_.open(std::move(client));
  greet(pages_.all().back());
}

void StateFeed::greet(Page& page) {
  const auto say = [&](std::string text, int slot = WebClient::in_order) {
    page.client->send(page_text(std::move(text)), false, slot);
  };
  say(hello(page.client->who()));
  say(zones_json(configuration_->scenario.zones));
  if (model_version_ > 0) say(model_json(model_version_));
  if (table_.number() != 0 && !table_.parts().empty()) say(entities());
  const std::vector<Event> events(events_.begin(), events_.end());
  say(events_json(events, start()));
  say(score_json(board_, start(), now()), page_slot::score);
  say(status_text(), page_slot::status);
  if (pose_known_) say(pose_json(pose_), page_slot::pose);
  if (info_.stamp.ns != 0) say(injection_json(info_), page_slot::injection);
  say(control_json(control()), page_slot::control);
  page.world_due = {};
  tell_operators();
}

void StateFeed::subscribe(std::uint64_t client, const Subscription& wanted) {
  if (Page* page = pages_.find(client)) page->wants = wanted;
}

std::string StateFeed::hello(const Identity& who) const {
  HelloWords words = options_.words;
  words.start = start();
  words.now = runtime::wall_now();
  return hello_json(*configuration_, who, words);
}

std::string StateFeed::entities() const {
  return entities_json(
      table_, [&](const std::string& entity, const std::string& part) { return shapes_.find(entity, part); },
      [&](const std::string& entity) {
        const AgentDefinition* definition = shapes_.definition(entity);
        return definition == nullptr ? std::string() : definition->model;
      });
}

std::string StateFeed::status_text() const {
  ServerStatus shown = status_;
  if (!deaf_.empty()) shown.notes.emplace_back("bus", "the base station receives nothing: " + deaf_);
  return status_json(shown, sensors_.states(options_.clock()));
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
  auto& all = pages_.all();
  if (std::none_of(all.begin(), all.end(), [&](const Page& page) { return now >= page.world_due; })) return;
  if (!read_world()) return;
  if (!table_.fits(world_) && due(table_due_, now, quarter_period)) {
    table_.renew(world_);
    pages_.tell(entities());
  }
  if (table_.number() == 0) return;
  const auto wants_scans = [](const Page& page) { return !page.wants.agent_scans.empty(); };
  if (std::any_of(all.begin(), all.end(), wants_scans)) agents_.take(world_);
  const double seconds_in = t(SimulationTime{world_.stamp.ns});
  const PageText frame = page_text(table_.frame(world_, seconds_in, info_.stamp.ns != 0 && !info_.live));
  for (Page& page : all) {
    if (now < page.world_due) continue;
    // A little early, so that worlds at exactly this rate are all sent.
    page.world_due = now + seconds(0.75 / page.wants.world_hz);
    page.client->send(frame, true, page_slot::world);
  }
}

void StateFeed::send_plans() {
  if (!read_world()) return;
  std::vector<EntityPlan> plans;
  const std::string* last = nullptr;
  for (const WorldMessage::Entry& body : world_.bodies) {
    if (plans.size() >= most_plans) break;
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
  pages_.tell(plans_json(plans), page_slot::plans);
}

void StateFeed::forget_silent_operators(WallTime now) {
  const auto gone = std::erase_if(operators_, [&](const auto& each) {
    return now - each.second.second > driving_timing::operator_shown;
  });
  operators_changed_ = operators_changed_ || gone > 0;
}

/// People see each other's real names.
void StateFeed::tell_operators() const {
  std::vector<OperatorWord> words;
  for (const auto& [name, word] : operators_) {
    words.push_back(word.first);
    for (const Page& page : pages_.all()) {
      if (operator_name(page.client->who()) == name) words.back().name = page.client->who().name;
    }
  }
  pages_.tell(operators_json(words), page_slot::operators);
}

void StateFeed::look(WallTime now) {
  forget_silent_operators(now);
  if (pages_.empty()) return;
  if (!new_events_.empty()) pages_.tell(events_json(std::exchange(new_events_, {}), start()));
  const bool second = due(second_, now, second_period), half = due(half_, now, half_period);
  if (std::exchange(operators_changed_, false)) tell_operators();
  if (std::exchange(score_changed_, false) || (second && board_.graded()))
    pages_.tell(score_json(board_, start(), this->now()), page_slot::score);
  if (std::exchange(injection_changed_, false) || (half && info_.stamp.ns != 0))
    pages_.tell(injection_json(info_), page_slot::injection);
  if (std::exchange(pose_changed_, false) || (half && pose_known_))
    pages_.tell(pose_json(pose_), page_slot::pose);
  if (second) pages_.tell(status_text(), page_slot::status);
  ControlState state = control();
  const std::string text = control_json(state);
  state.position = 0;
  std::string without_position = control_json(state);
  if (half || without_position != said_control_) pages_.tell(text, page_slot::control);
  said_control_ = std::move(without_position);
  if (!due(quarter_, now, quarter_period)) return;
  send_plans();
  if (joints_) pages_.tell(joints_json(configuration_->robot.name, *joints_), page_slot::joints);
  if (hazard_) pages_.tell(hazard_json(*hazard_, t(sensors_.to_server(hazard_->stamp))), page_slot::hazard);
  joints_.reset();
  hazard_.reset();
}

}  // namespace parhelion::station

#include <algorithm>
#include <numbers>

#include "protocols/channels.hpp"
#include "server/review/gathering.hpp"

namespace parhelion::review {

Status Gathering::spawn(Message& message) {
  // The server has refused what cannot be read.
  if (AgentSpawn command; decode(message.channel, message.payload, command).ok()) shapes_->take(command);
  return {};
}

Status Gathering::event(Message& message) {
  Event event;
  if (const Status read = decode(message.channel, message.payload, event); !read) return read;
  seen(event.stamp);
  if (!for_trainee()) {
    list(std::move(event));
    return {};
  }
  shapes_->take(event);
  knowledge_->take(event, world_);
  if (auto visible = view_->event(event)) list(*std::move(visible));
  return {};
}

/// All kinds are represented, however many events there are of one.
void Gathering::list(Event&& event) {
  if (event.kind == EventKind::contact_continues) return;
  if (++listed_[event.kind] <= limits_.events_of_kind)
    review_.events.push_back(std::move(event));
  else
    ++review_.events_left_out[to_string(event.kind)];
}

Status Gathering::world(Message& message) {
  if (const Status read = decode(message.channel, message.payload, world_); !read) return read;
  const double t = seen(SimulationTime{world_.stamp.ns});
  if (for_trainee() && !robot_)
    if (const AgentDefinition* agent = shapes_->definition(review_.robot))
      knowledge_->handle_scan_of(*agent, world_);
  const std::string* before = nullptr;  // the bodies of an entity are consecutive, and only the first one
                                        // counts
  for (const WorldMessage::Entry& body : world_.bodies) {
    if (body.owner == BodyOwner::building || (before && *before == body.entity)) continue;
    before = &body.entity;
    if (for_trainee() && !view_->may_follow(body.entity) && !senses(body.entity)) continue;
    follow(body, t);
    if (body.entity == review_.robot) attitude(body, t, body.attitude_known);
  }
  return {};
}

/// True while the trainee's robot senses the entity.
bool Gathering::senses(const std::string& entity) const {
  const runtime::Sensed* sensed = view_->sensed(entity);
  return sensed != nullptr && SimulationTime{world_.stamp.ns} - sensed->last < runtime::kSensedNow;
}

void Gathering::follow(const WorldMessage::Entry& body, double t) {
  auto [trail, is_new] = trails_.try_emplace(body.entity);
  if (is_new) trail->second = {body.entity, body.kind, Track(limits_.path_points)};
  auto [epoch, first] = epochs_.try_emplace(body.entity, body.epoch);
  const Eigen::Vector3d p = body.T_map_body.translation();
  trail->second.track.add({t, p.x(), p.y(), body.T_map_body.yaw(), body.velocity.head<2>().norm(),
                           first || epoch->second != body.epoch});
  epoch->second = body.epoch;
}

void Gathering::attitude(const WorldMessage::Entry& body, double t, bool known) {
  add("speed", t, body.velocity.head<2>().norm());
  if (!known) return;
  constexpr double degrees = 180 / std::numbers::pi;
  const Eigen::Matrix3d R = body.T_map_body.rotation();
  // Positive: nose up, left side up.
  add("pitch", t, degrees * std::asin(std::clamp(R(2, 0), -1.0, 1.0)));
  add("roll", t, degrees * std::atan2(R(2, 1), R(2, 2)));
}

Status Gathering::scan(Message& message) {
  have_scan_ = false;
  // Malformed scans were passed on unchanged; they contain nothing to measure.
  if (!decode(message.channel, message.payload, scan_)) return {};
  have_scan_ = true;
  at(message.arrival);
  measure_nearest();
  return {};
}

Status Gathering::scan_info(Message& message) {
  have_info_ = false;
  if (const Status read = decode(message.channel, message.payload, info_); !read) return read;
  have_info_ = true;
  if (for_trainee() && info_.live) knowledge_->handle_scan(info_, robot_.value_or(0), world_);
  measure_nearest();
  return {};
}

/// Of a laser after the first.
Status Gathering::further_scan_info(Message& message) {
  ScanInfo info;
  if (const Status read = decode(message.channel, message.payload, info); !read) return read;
  if (for_trainee() && info.live) knowledge_->handle_scan(info, robot_.value_or(0), world_);
  return {};
}

/// The two messages arrive in either order.
void Gathering::measure_nearest() {
  if (!have_scan_ || !have_info_ || scan_.stamp != info_.stamp) return;
  have_scan_ = have_info_ = false;
  const auto distances = nearest_->of(scan_, &info_);
  add("nearest", review_.duration, distances.any);
  add("nearest_injected", review_.duration, distances.injected);
}

Status Gathering::asked(Message& message) {
  TwistCommand command;
  // The server has refused a malformed input, so it commanded nothing.
  if (!decode(message.channel, message.payload, command)) return {};
  const double t = at(message.arrival);
  add("commanded_forward", t, command.twist.vx);
  add("commanded_turn", t, command.twist.wz);
  return delay("delay_teleop", message);
}

Status Gathering::given(Message& message) {
  TwistCommand command;
  if (const Status read = decode(message.channel, message.payload, command); !read) return read;
  const double t = at(message.arrival);
  add("applied_forward", t, command.twist.vx);
  add("applied_turn", t, command.twist.wz);
  return {};
}

Status Gathering::picture(Message& message) {
  if (for_trainee() && robot_) knowledge_->handle_picture(*robot_, world_);
  pictures_.saw(at(message.arrival), std::move(message.payload));
  return {};
}

Status Gathering::loop(Message& message) {
  LoopDecision decision;
  if (const Status read = decode(message.channel, message.payload, decision); !read) return read;
  if (decision.kind == LoopDecision::Kind::ended) ended_ = true;
  return {};
}

/// Reads the stamp from the bytes. The server has refused messages that are malformed otherwise.
Status Gathering::delay(const char* name, const Message& message) {
  const auto stamp = leading_stamp(message.payload);
  if (!stamp) return {};
  const double late = Duration{message.arrival.ns - stamp->ns}.seconds();
  const auto [smallest, first] = review_.min_delay.try_emplace(name, late);
  if (!first) smallest->second = std::min(smallest->second, late);
  add(name, at(message.arrival), late);
  return {};
}

}  // namespace parhelion::review

#include "server/simulation/bodies/handling.hpp"

#include <algorithm>

namespace parhelion::simulation {

void GripperWatch::report(const EventContext& context, EventKind kind, const std::string& object,
                          const HandledBody& body, double value) {
  Event event;
  event.stamp = context.now;
  event.kind = kind;
  event.subject = context.robot;
  event.object = object;
  event.pair = context.pair;
  event.position = body.center;
  event.value = value;
  context.events.push_back(std::move(event));
}

void GripperWatch::press(const std::vector<FingerForce>& forces, const Look& look,
                         const EventContext& context) {
  for (const FingerForce& force : forces) {
    if (force.force < kPinch) continue;
    double other = 0;
    for (const FingerForce& each : forces) {
      if (each.finger > force.finger && *each.load == *force.load) other = std::max(other, each.force);
    }
    if (other < kPinch) continue;
    const auto known = held_.find(*force.load);
    if (known != held_.end() && !known->second.released) {
      known->second.pressed = context.now;
      continue;
    }
    const auto body = look(*force.load);
    if (!body) continue;
    Held held;
    held.epoch = body->epoch;
    held.lay = body->lowest;
    held.pressed = context.now;
    held_.insert_or_assign(*force.load, held);
    report(context, EventKind::gripped, *force.load, *body, std::min(force.force, other));
  }
}

bool GripperWatch::follow(const std::string& load, Held& held, const HandledBody& body,
                          const Eigen::Vector3d& pads, const EventContext& context) {
  const bool pressed = held.pressed == context.now;
  if (!pressed && (context.now - held.pressed).seconds() > kReleaseTime) held.released = true;
  const double height = body.lowest - held.lay;
  if (pressed && !held.lifted && height > kLift) {
    held.lifted = held.was_lifted = true;
    held.grip = body.T_map_body.inverse() * pads;
    report(context, EventKind::lifted, load, body, height);
  } else if (pressed && held.lifted && height < kLift / 2) {
    held.lifted = false;
  }
  if (held.lifted && !held.dropped) {
    const bool slips = body.rigid && pressed && (body.T_map_body.inverse() * pads - held.grip).norm() > kSlip;
    const bool falls = !pressed && body.velocity.z() < -kSink && body.over.empty();
    if (slips || falls) report(context, EventKind::dropped, load, body, height);
    held.dropped = slips || falls;
  }
  return !held.released || settle(load, held, body, context);
}

bool GripperWatch::settle(const std::string& load, Held& held, const HandledBody& body,
                          const EventContext& context) {
  if (held.still_since) held.moved += (context.now - held.followed).seconds() * body.velocity;
  held.followed = context.now;
  if (!held.still_since || held.moved.norm() >= kStill * kRest) {
    held.still_since = context.now;
    held.moved.setZero();
  }
  if ((context.now - *held.still_since).seconds() < kRest)
    return (context.now - held.pressed).seconds() < kForget;
  if (held.was_lifted && !body.in.empty()) {
    report(context, EventKind::placed, body.in, body, 0);
    context.events.back().text = load;
  }
  return false;
}

void GripperWatch::update(const std::string& robot, PairKind pair, const Eigen::Vector3d& pads,
                          const std::vector<FingerForce>& forces, const Look& look, SimulationTime now,
                          std::vector<Event>& events) {
  const EventContext context{robot, pair, now, events};
  press(forces, look, context);
  for (auto entry = held_.begin(); entry != held_.end();) {
    const auto body = look(entry->first);
    const bool there = body && body->epoch == entry->second.epoch;
    const bool keep = there && follow(entry->first, entry->second, *body, pads, context);
    entry = keep ? std::next(entry) : held_.erase(entry);
  }
}

}  // namespace parhelion::simulation

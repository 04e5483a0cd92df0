#include "server/simulation/handling.hpp"

#include <algorithm>
#include <cmath>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {

void GripperWatch::say(const Saying& saying, EventKind kind, const std::string& object,
                       const HandledBody& body, double value) {
  Event event;
  event.stamp = saying.now;
  event.kind = kind;
  event.subject = saying.robot;
  event.object = object;
  event.pair = saying.pair;
  event.position = body.center;
  event.value = value;
  saying.events.push_back(std::move(event));
}

void GripperWatch::press(const std::vector<FingerForce>& forces, const Look& look, const Saying& saying) {
  for (const FingerForce& force : forces) {
    if (force.force < kPinch) continue;
    double other = 0;
    for (const FingerForce& each : forces) {
      if (each.finger > force.finger && *each.load == *force.load) other = std::max(other, each.force);
    }
    if (other < kPinch) continue;
    const auto known = held_.find(*force.load);
    if (known != held_.end() && !known->second.released) {
      known->second.pressed = saying.now;
      continue;
    }
    const auto body = look(*force.load);
    if (!body) continue;
    Held held;
    held.epoch = body->epoch;
    held.lay = body->lowest;
    held.pressed = saying.now;
    held_.insert_or_assign(*force.load, held);
    say(saying, EventKind::gripped, *force.load, *body, std::min(force.force, other));
  }
}

bool GripperWatch::follow(const std::string& load, Held& held, const HandledBody& body,
                          const Eigen::Vector3d& pads, const Saying& saying) {
  const bool pressed = held.pressed == saying.now;
  if (!pressed && (saying.now - held.pressed).seconds() > kLetGo) held.released = true;
  const double height = body.lowest - held.lay;
  if (pressed && !held.lifted && height > kLift) {
    held.lifted = held.was_lifted = true;
    held.grip = body.T_map_body.inverse() * pads;
    say(saying, EventKind::lifted, load, body, height);
  } else if (pressed && held.lifted && height < kLift / 2) {
    held.lifted = false;
  }
  if (held.lifted && !held.dropped) {
    const bool slips = body.rigid && pressed && (body.T_map_body.inverse() * pads - held.grip).norm() > kSlip;
    const bool falls = !pressed && body.velocity.z() < -kSink && body.over.empty();
    if (slips || falls) say(saying, EventKind::dropped, load, body, height);
    held.dropped = slips || falls;
  }
  return !held.released || settle(load, held, body, saying);
}

bool GripperWatch::settle(const std::string& load, Held& held, const HandledBody& body,
                          const Saying& saying) {
  if (body.velocity.norm() >= kStill) {
    held.still_since.reset();
  } else if (!held.still_since) {
    held.still_since = saying.now;
  }
  if (!held.still_since || (saying.now - *held.still_since).seconds() < kRest)
    return (saying.now - held.pressed).seconds() < kForget;
  if (held.was_lifted && !body.in.empty()) {
    say(saying, EventKind::placed, body.in, body, 0);
    saying.events.back().text = load;
  }
  return false;
}

void GripperWatch::update(const std::string& robot, PairKind pair, const Eigen::Vector3d& pads,
                          const std::vector<FingerForce>& forces, const Look& look, SimulationTime now,
                          std::vector<Event>& events) {
  const Saying saying{robot, pair, now, events};
  press(forces, look, saying);
  for (auto entry = held_.begin(); entry != held_.end();) {
    const auto body = look(entry->first);
    const bool there = body && body->epoch == entry->second.epoch;
    const bool keep = there && follow(entry->first, entry->second, *body, pads, saying);
    entry = keep ? std::next(entry) : held_.erase(entry);
  }
}

namespace {

constexpr double kOver = 1.5;     // m over its bottom: what falls from there falls in
constexpr double kUpright = 0.9;  // cosine of how a container may lean

/// z of the lowest corner of its box.
double lowest_of(const Agent& agent) {
  double lowest = std::numeric_limits<double>::infinity();
  if (agent.cable) {
    for (const Eigen::Vector3d& point : agent.cable->points())
      lowest = std::min(lowest, point.z() - agent.cable->form().radius);
    return lowest;
  }
  const Eigen::Vector3d& size = agent.form.size;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 1 : 0);
    lowest = std::min(lowest, (agent.rigid.T_map_body * Eigen::Vector3d(p.cwiseProduct(size))).z());
  }
  return lowest;
}

}  // namespace

std::optional<HandledBody> Simulation::State::handled(const std::string& name) {
  const Agent* load = find(name);
  if (load == nullptr) return std::nullopt;
  HandledBody body;
  body.epoch = load->epoch;
  body.rigid = !load->cable;
  body.T_map_body = load->rigid.T_map_body;
  body.center = body.T_map_body * Eigen::Vector3d(0, 0, load->cable ? 0 : load->form.size.z() / 2);
  body.velocity = load->rigid.velocity;
  body.lowest = lowest_of(*load);
  for (const auto& agent : agents) {
    if (agent->definition.kind != AgentKind::container || agent.get() == load) continue;
    const Transform<Map, Body>& T_map_container = agent->rigid.T_map_body;
    if (T_map_container.rotation()(2, 2) < kUpright) continue;
    const Eigen::Vector3d p = T_map_container.inverse() * body.center;
    const Eigen::Vector3d& size = agent->form.size;
    const bool inside = std::abs(p.x()) < size.x() / 2 - kContainerWall &&
                        std::abs(p.y()) < size.y() / 2 - kContainerWall && p.z() > 0 && p.z() < kOver;
    if (!inside) continue;
    body.over = agent->definition.name;
    if (p.z() < size.z()) {
      body.in = body.over;
      body.velocity -= agent->rigid.velocity;
    }
    break;
  }
  return body;
}

void Simulation::State::watch_grippers() {
  for (const auto& agent : agents) {
    if (!agent->robot || agent->robot->model().gripper.empty()) continue;
    ArticulatedRobot& robot = *agent->robot;
    const auto& links = robot.model().gripper;
    finger_forces.clear();
    for (const PhysicsContact& contact : physics.contacts()) {
      const bool is_a = robot.owns(contact.a);
      if (!is_a && !robot.owns(contact.b)) continue;
      const std::string& link =
          robot.link_name(is_a ? contact.a : contact.b, is_a ? contact.shape_a : contact.shape_b);
      const auto finger = std::find(links.begin(), links.end(), link);
      if (finger == links.end()) continue;
      const PhysicsHandle other = is_a ? contact.b : contact.a;
      const auto load = std::find_if(agents.begin(), agents.end(), [&](const auto& each) {
        return !each->robot && !each->form.upright &&
               (each->cable ? each->cable->owns(other) : each->handle == other);
      });
      if (load == agents.end()) continue;
      finger_forces.push_back({&(*load)->definition.name, static_cast<std::size_t>(finger - links.begin()),
                               contact.impulse / dt});
    }
    agent->gripper.update(
        agent->definition.name, agent->trainee ? PairKind::real_virtual : PairKind::virtual_virtual,
        robot.gripper_center(), finger_forces, [this](const std::string& name) { return handled(name); },
        stamp_of(step), events);
  }
}

}  // namespace parhelion::simulation

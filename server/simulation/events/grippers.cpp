#include "server/simulation/events/grippers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace parhelion::simulation {
namespace {

constexpr double kOver = 1.5;     // m over its bottom: objects dropped from this range fall into it
constexpr double kUpright = 0.9;  // cosine of a container's maximum tilt

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

/// None: no such agent.
std::optional<HandledBody> handled(const std::string& name, const Agents& agents) {
  const Agent* load = agents.find(name);
  if (load == nullptr) return std::nullopt;
  HandledBody body;
  body.epoch = load->epoch;
  body.rigid = !load->cable;
  body.T_map_body = load->rigid.T_map_body;
  body.center = body.T_map_body * Eigen::Vector3d(0, 0, load->cable ? 0 : load->form.size.z() / 2);
  body.velocity = load->rigid.velocity;
  body.lowest = lowest_of(*load);
  for (const Agent& agent : agents) {
    if (agent.definition.kind != AgentKind::container || &agent == load) continue;
    const Transform<Map, Body>& T_map_container = agent.rigid.T_map_body;
    if (T_map_container.rotation()(2, 2) < kUpright) continue;
    const Eigen::Vector3d p = T_map_container.inverse() * body.center;
    const Eigen::Vector3d& size = agent.form.size;
    const bool inside = std::abs(p.x()) < size.x() / 2 - kContainerWall &&
                        std::abs(p.y()) < size.y() / 2 - kContainerWall && p.z() > 0 && p.z() < kOver;
    if (!inside) continue;
    body.over = agent.definition.name;
    if (p.z() < size.z()) {
      body.in = body.over;
      body.velocity -= agent.rigid.velocity;
    }
    break;
  }
  return body;
}

}  // namespace

void Grippers::collect_forces(const ArticulatedRobot& robot, const Agents& agents, const Physics& physics,
                              double dt) {
  const auto& links = robot.model().gripper;
  forces_.clear();
  for (const PhysicsContact& contact : physics.contacts()) {
    const bool is_a = robot.owns(contact.a);
    if (!is_a && !robot.owns(contact.b)) continue;
    const std::string& link =
        robot.link_name(is_a ? contact.a : contact.b, is_a ? contact.shape_a : contact.shape_b);
    const auto finger = std::find(links.begin(), links.end(), link);
    if (finger == links.end()) continue;
    const PhysicsHandle other = is_a ? contact.b : contact.a;
    const auto load = std::find_if(agents.begin(), agents.end(), [&](const Agent& each) {
      return !each.robot && !each.form.upright &&
             (each.cable ? each.cable->owns(other) : each.handle == other);
    });
    if (load == agents.end()) continue;
    forces_.push_back(
        {&load->definition.name, static_cast<std::size_t>(finger - links.begin()), contact.impulse / dt});
  }
}

void Grippers::update(Agents& agents, const Physics& physics, const StepClock& clock,
                      std::vector<Event>& events) {
  const auto look = [&agents](const std::string& name) { return handled(name, agents); };
  for (Agent& agent : agents) {
    if (!agent.robot || agent.robot->model().gripper.empty()) continue;
    collect_forces(*agent.robot, agents, physics, clock.dt);
    agent.gripper.update(agent.definition.name,
                         agent.trainee ? PairKind::real_virtual : PairKind::virtual_virtual,
                         agent.robot->gripper_center(), forces_, look, clock.now(), events);
  }
}

void Grippers::update(RealRobots& real_robots, Agents& agents, Physics& physics, const StepClock& clock,
                      std::vector<Event>& events) {
  const auto look = [&agents](const std::string& name) { return handled(name, agents); };
  for (RealRobot& robot : real_robots) {
    if (!robot.twin || robot.twin->fingers().empty() || !robot.ever_present) continue;
    const bool frozen = !robot.encoders_fresh || !robot.present;
    robot.grip.update({robot.name, *robot.twin, robot.payload, physics, clock.now(), events}, frozen, agents);
    robot.grip.watch.update(robot.name, PairKind::real_virtual, RealGrip::center(*robot.twin),
                            robot.grip.forces(), look, clock.now(), events);
  }
}

}  // namespace parhelion::simulation

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kSight = 3.0;      // m: what is farther does not matter to a decision
constexpr double kForesight = 0.7;  // s that another's motion is expected to go on
constexpr double kReached = 0.3;    // m from a waypoint
constexpr double kPatience = 3.0;   // s that a patrol waits before it looks for a way round
constexpr double kHoldRange = 2.0;  // m from the real robot within which agents hold still while it is blind
constexpr double kRespect = 0.15;   // m kept to the real robot beyond what is kept to everything
constexpr double kScanAge = 0.5;    // s: an older scan of its own is not trusted
constexpr double kTurningFeet = 0.3;  // m/rad that feet go in a turn on the spot
constexpr double kSmallSteps = 0.35;  // share of a whole step's height and reach
constexpr double kStands = 0.05;      // m/s: slower, and the feet stand

/// SplitMix64 (Steele, Lea, Flood 2014) of (seed, agent, step): no state that a skipped decision could shift.
double random_unit(std::uint64_t seed, std::uint64_t key, std::uint64_t step, std::uint64_t draw) {
  std::uint64_t z =
      seed * 0x9E3779B97F4A7C15ULL + key + step * 0xD1B54A32D192ED03ULL + draw * 0x8CB92BA72F3D8DD7ULL;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
}

double towards(double from, double to, double most) { return from + std::clamp(to - from, -most, most); }

}  // namespace

SteeringLimits limits_of(const Agent& agent) {
  SteeringLimits limits;
  limits.speed = agent.definition.behaviour.speed;
  limits.radius = agent.form.footprint.bound;
  if (agent.definition.kind == AgentKind::person) {
    limits.yaw_rate = 2.0;
    limits.acceleration = 1.2;
    limits.angular_acceleration = 6.0;
  }
  return limits;
}

bool Simulation::State::held_still(const Agent& agent) const {
  if (agent.frozen) return true;
  const bool sensed = real.sensed && agent.shown == AgentShown::shown;
  if (sensed || !real.ever_present) return false;
  const double speed = std::hypot(real.last.twist.vx, real.last.twist.vy);
  const double way = speed * real.limits.reaction_time + speed * speed / (2 * real.limits.deceleration);
  return distance_bound(agent.placed, real.placed) < kHoldRange + way;
}

void Simulation::State::gather_obstacles(const Agent& agent, double range) {
  steering.obstacles.clear();
  std::size_t used = 0;
  // The vector only grows: pointers into it are taken when it is complete.
  const auto predict = [&](const Eigen::Vector2d& center, const Eigen::Vector2d& velocity, double radius) {
    if (used == steering.predicted.size()) steering.predicted.push_back(make_segment(center, center, radius));
    Footprint& swept = steering.predicted[used++];
    swept.vertices[0] = center;
    swept.vertices[1] = center + kForesight * velocity;
    swept.radius = radius;
    swept.update_bound();
  };
  const Eigen::Vector2d p = agent.pose.position();
  const bool sees =
      agent.laser && agent.laser->measured && (stamp_of(step) - *agent.laser->measured).seconds() < kScanAge;
  if (sees) {
    for (const Footprint& point : agent.laser->points) steering.obstacles.push_back(&point);
  } else {
    near.clear();
    building->near(p, range, agent.floor + 0.02, agent.floor + agent.form.size.z(), near);
    const bool wanders = agent.definition.behaviour.kind == BehaviourKind::wander;
    for (const FixedObstacle* obstacle : near) {
      if (wanders || !walks_through(agent, *obstacle)) steering.obstacles.push_back(&obstacle->footprint);
    }
  }
  for (const Footprint& disc : real_discs) {
    if ((disc.center - p).norm() < range + disc.bound) steering.obstacles.push_back(&disc);
  }
  nearby.clear();
  if (!sees) neighbours.near(p, range, nearby);
  for (const std::uint32_t i : nearby) {
    const Agent* other = agents[i].get();
    if (other == &agent || (other->placed.center - p).norm() > range + other->placed.bound) continue;
    if (other->form.upright) {
      predict(other->placed.center, other->rigid.velocity.head<2>(), other->placed.bound);
    } else {
      steering.obstacles.push_back(&other->placed);
    }
  }
  // The real robot is kept clear of whether or not an agent's own laser reaches it.
  if (real.ever_present && (real.placed.center - p).norm() < range + real.placed.bound) {
    const Eigen::Vector3d velocity =
        real.last.T_map_base.rotation() * Eigen::Vector3d(real.last.twist.vx, real.last.twist.vy, 0);
    predict(real.placed.center, velocity.head<2>(), real.placed.bound + kRespect);
  }
  for (std::size_t i = 0; i < used; ++i) steering.obstacles.push_back(&steering.predicted[i]);
}

Twist2 Simulation::State::wander(Agent& agent) {
  SteeringState& steer_state = agent.steering;
  if (step >= steer_state.heading_until) {
    const double turn = random_unit(options.seed, agent.key, step, 0) - 0.5;
    const double pause = 4 + 6 * random_unit(options.seed, agent.key, step, 1);
    steer_state.heading = wrap_angle(agent.pose.yaw + turn * 1.5 * std::numbers::pi);
    steer_state.heading_until = step + static_cast<std::uint64_t>(pause * options.rate);
  }
  return steer(agent.pose, limits_of(agent), steering, steer_state);
}

Twist2 Simulation::State::patrol(Agent& agent) {
  SteeringState& steer_state = agent.steering;
  const auto& waypoints = agent.definition.behaviour.waypoints;
  steer_state.waypoint %= waypoints.size();
  Eigen::Vector2d to = waypoints[steer_state.waypoint] - agent.pose.position();
  if (to.norm() < kReached) {
    steer_state.waypoint = (steer_state.waypoint + 1) % waypoints.size();
    steer_state.waited = 0;
    to = waypoints[steer_state.waypoint] - agent.pose.position();
    if (to.norm() < kReached) return {};  // a single waypoint: it has arrived
  }
  if (step < steer_state.detour_until) return wander(agent);
  steer_state.heading = std::atan2(to.y(), to.x());
  Twist2 twist = steer(agent.pose, limits_of(agent), steering, steer_state);
  const double distance = to.norm();
  const Eigen::Vector2d ahead(std::cos(agent.pose.yaw), std::sin(agent.pose.yaw));
  // Near a waypoint it goes slower, or it would circle it.
  twist.vx = std::min(twist.vx, std::max(0.1, distance));
  const bool progress = twist.vx > 0.05 && ahead.dot(to) > 0;
  steer_state.waited = progress ? std::max(0.0, steer_state.waited - 2 * kDecisionPeriod)
                                : steer_state.waited + kDecisionPeriod;
  if (steer_state.waited > kPatience) {
    steer_state.waited = 0;
    steer_state.heading_until = 0;
    steer_state.detour_until =
        step +
        static_cast<std::uint64_t>((2 + 2 * random_unit(options.seed, agent.key, step, 2)) * options.rate);
  }
  return twist;
}

Twist2 Simulation::State::decide(Agent& agent) {
  if (agent.definition.behaviour.yields) {
    if (const auto aside = step_aside(agent)) return *aside;
  }
  switch (agent.definition.behaviour.kind) {
    case BehaviourKind::patrol:
      return patrol(agent);
    case BehaviourKind::wander:
      return wander(agent);
    case BehaviourKind::follow:
      return follow(agent);
    case BehaviourKind::flee:
      return flee(agent);
    case BehaviourKind::block:
      return block(agent);
    case BehaviourKind::go:
      return go(agent);
    case BehaviourKind::stay:
    case BehaviourKind::teleop:
      break;
  }
  return {};
}

/// Decisions of many agents are spread over the steps.
bool Simulation::State::decides(const Agent& agent) const {
  const auto period = static_cast<std::uint64_t>(std::max(1.0, std::round(kDecisionPeriod * options.rate)));
  return (step + agent.turn) % period == 0;
}

Twist2 Simulation::State::wanted(Agent& agent) {
  const Behaviour& behaviour = agent.definition.behaviour;
  if (held_still(agent) || (behaviour.kind == BehaviourKind::stay && !behaviour.yields)) return {};
  if (behaviour.kind == BehaviourKind::teleop) {
    return agent.teleop_until && stamp_of(step) <= *agent.teleop_until ? agent.teleop : Twist2{};
  }
  if (decides(agent)) {
    gather_obstacles(agent, kSight);
    agent.steering.wanted = decide(agent);
  }
  return agent.steering.wanted;
}

void Simulation::State::drive_agents() {
  take_routes();
  neighbours.place(agents.size(), [this](std::size_t i) {
    return std::pair(agents[i]->placed.center, agents[i]->placed.bound);
  });
  for (const auto& agent : agents) {
    if (!agent->form.upright) continue;
    const SteeringLimits limits = limits_of(*agent);
    const Twist2 twist = wanted(*agent);
    if (agent->robot) {
      agent->robot->drive(physics, agent->supply.empty ? Twist2{} : twist, stamp_of(step), dt);
      continue;
    }
    const bool walks = agent->definition.kind == AgentKind::person;
    agent->driven.vx = towards(agent->driven.vx, twist.vx,
                               (twist.vx < agent->driven.vx ? 1.5 : 1) * limits.acceleration * dt);
    agent->driven.vy = walks ? towards(agent->driven.vy, twist.vy, limits.acceleration * dt) : 0;
    agent->driven.wz = towards(agent->driven.wz, twist.wz, limits.angular_acceleration * dt);
    if (decides(*agent)) set_coasting(*agent, !options.solve_all && alone(*agent));
    const double friction = walks ? 0.9 : 0.6;
    if (agent->coasts)
      Physics::drive(agent->rigid, agent->driven, friction, dt);
    else
      physics.drive(agent->handle, agent->driven, friction);
  }
}

/// Wheels turn and feet walk by the way that the body really went, pushed or not.
void Simulation::State::move_parts(Agent& agent) {
  if (!agent.form.upright) return;
  PartMotion& parts = agent.parts;
  const Eigen::Vector3d v = agent.rigid.T_map_body.rotation().transpose() * agent.rigid.velocity;
  const double w = agent.rigid.rotation_rate.z();
  const double turn = 2 * std::numbers::pi;
  parts.wheel_left =
      wrap_angle(parts.wheel_left + (v.x() - w * kRobotDrive.track / 2) / kRobotDrive.wheel_radius * dt);
  parts.wheel_right =
      wrap_angle(parts.wheel_right + (v.x() + w * kRobotDrive.track / 2) / kRobotDrive.wheel_radius * dt);
  const double speed = std::hypot(v.x(), v.y());
  // A turn on the spot takes steps as well, as many as its feet would go about the middle.
  const double pace = std::max(speed, kTurningFeet * std::abs(w));
  // Sideways no leg swings back: only where it mostly goes backwards does the gait run backwards.
  const double direction = v.x() < -0.5 * speed ? -1 : 1;
  // Feet swing as far to the front as the way goes to the front; steps aside and turns are small ones, and so
  // there are more of them.
  const double reach = pace > kStands ? std::max(kSmallSteps, std::abs(v.x()) / pace) : 0;
  const double stride = std::max(kSmallSteps, reach) * stride_length(agent.definition.behaviour.speed);
  parts.gait_phase = wrap_angle(parts.gait_phase + direction * pace / stride * turn * dt);
  parts.gait_amplitude = towards(parts.gait_amplitude, reach, 3 * dt);
}

Status Simulation::State::fit_laser(Agent& agent) {
  if (agent.definition.laser.empty()) return {};
  const std::string who = "agent '" + agent.definition.name + "': ";
  if (agent.definition.kind != AgentKind::robot) return Error{who + "only a robot carries a laser"};
  auto preset = load_laser_preset(agent.definition.laser);
  if (!preset) return Error{who + preset.error().message};
  AgentLaser laser;
  laser.description = std::move(preset).value();
  laser.description.T_base_laser = agent_laser_mount();
  if (agent.robot && agent.robot->model().description.laser)
    laser.description.T_base_laser = agent.robot->model().description.laser->T_base_laser;
  if (laser.description.scan_period <= 0) laser.description.scan_period = 0.1;
  laser.next = stamp_of(step);
  agent.laser = std::move(laser);
  return {};
}

void Simulation::State::ask_lasers(std::vector<LaserRequest>& requests) {
  const SimulationTime now = stamp_of(step);
  for (const auto& agent : agents) {
    if (!agent->laser || now < agent->laser->next) continue;
    AgentLaser& laser = *agent->laser;
    while (laser.next <= now) laser.next = laser.next + seconds(laser.description.scan_period);
    laser.asked = now;
    laser.T_map_laser =
        Transform<Map, Base>(agent->rigid.T_map_body.isometry()) * laser.description.T_base_laser;
    LaserRequest request{agent->definition.name, now, laser.T_map_laser, laser.description, {}};
    for (std::size_t i = 0; i < agent->body_count; ++i) {
      request.own_bodies.push_back(agent->first_body + static_cast<BodyId>(i));
    }
    requests.push_back(std::move(request));
  }
}

/// The nearest return of each sector of 4 degrees becomes an obstacle of the agent's behaviour.
void Simulation::give_scan(const std::string& agent_name, const Scan& scan) {
  Agent* agent = state_->find(agent_name);
  if (!agent || !agent->laser) return;
  AgentLaser& laser = *agent->laser;
  constexpr double sector_width = 4 * std::numbers::pi / 180;
  laser.points.clear();
  double sector_end = -1;
  float nearest = 0;
  double nearest_angle = 0;
  const auto close_sector = [&] {
    if (nearest <= 0) return;
    const Eigen::Vector3d p = laser.T_map_laser * Eigen::Vector3d(nearest * std::cos(nearest_angle),
                                                                  nearest * std::sin(nearest_angle), 0);
    laser.points.push_back(make_disc({p.x(), p.y()}, 0.02));
    nearest = 0;
  };
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double swept = static_cast<double>(i) * std::abs(static_cast<double>(scan.angle_step));
    if (swept > sector_end) {
      close_sector();
      sector_end = swept + sector_width;
    }
    const float range = scan.ranges[i];
    if (laser.description.convention.classify(range) != BeamKind::hit || range > kSight) continue;
    if (nearest <= 0 || range < nearest) {
      nearest = range;
      nearest_angle = scan.angle_first + static_cast<double>(i) * scan.angle_step;
    }
  }
  close_sector();
  laser.measured = laser.asked;
}

}  // namespace parhelion::simulation

#include "server/simulation/events/supervision.hpp"

#include "server/simulation/events/robot_supply_watch.hpp"
#include "server/simulation/robots/base_body.hpp"

namespace parhelion::simulation {
namespace {

ObservedMotion motion_of(const RealRobot& robot, SimulationTime now) {
  const Eigen::Matrix3d R = robot.last.T_map_base.rotation();
  const Twist2& twist = robot.last.twist;
  return {now,
          robot.last.T_map_base,
          R * Eigen::Vector3d(twist.vx, twist.vy, 0),
          R.col(2) * twist.wz,
          robot.last.attitude_known,
          robot.epoch};
}

ObservedMotion motion_of(const Agent& agent, SimulationTime now) {
  if (agent.robot) {
    const RobotMotion& robot = agent.robot->motion();
    return {now, robot.T_map_base, robot.velocity, robot.rotation_rate, true, robot.epoch};
  }
  const RigidState& rigid = agent.rigid;
  return {now, base_of(rigid.T_map_body), rigid.velocity, rigid.rotation_rate, true, agent.epoch};
}

}  // namespace

void supervise(RealRobots& real_robots, Agents& agents, const Surroundings& around, const Contacts& contacts,
               const Physics& physics, Predictor& predictor, std::vector<Event>& events) {
  const std::vector<Zone>& zones = around.options.zones;
  const double dt = around.clock.dt;
  for (RealRobot& robot : real_robots) {
    if (!robot.present) continue;
    const ObservedMotion motion = motion_of(robot, around.clock.now());
    robot.watch.update(motion, zones, around.building(), dt, events);
    predictor.predict(robot, motion, around, contacts, events);
  }
  for (Agent& agent : agents) {
    const ObservedMotion motion = motion_of(agent, around.clock.now());
    agent.watch.update(motion, zones, around.building(), dt, events);
    if (!agent.robot) continue;
    predictor.predict(agent, motion, around, contacts, events);
    watch_radio(agent, motion, around, events);
    watch_battery(agent, motion, around, physics, events);
  }
}

}  // namespace parhelion::simulation

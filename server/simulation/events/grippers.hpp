// The grippers of all robots with links: the forces of the links in a step.
#pragma once

#include <vector>

#include "protocols/event.hpp"
#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/handling.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/bodies/step_clock.hpp"
#include "server/simulation/physics/physics.hpp"

namespace parhelion::simulation {

class Grippers {
 public:
  /// After a step: appends the events of each GripperWatch.
  void update(Agents& agents, const Physics& physics, const StepClock& clock, std::vector<Event>& events);
  /// The same for the real robots, whose grippers take things and let them go.
  static void update(RealRobots& real_robots, Agents& agents, Physics& physics, const StepClock& clock,
                     std::vector<Event>& events);

 private:
  void collect_forces(const ArticulatedRobot& robot, const Agents& agents, const Physics& physics, double dt);
  std::vector<FingerForce> forces_;  // reused memory
};

}  // namespace parhelion::simulation

// The grippers of all robots with links: the forces of the links in a step.
#pragma once

#include <vector>

#include "protocols/event.hpp"
#include "server/simulation/agents.hpp"
#include "server/simulation/handling.hpp"
#include "server/simulation/physics.hpp"
#include "server/simulation/real_robot.hpp"
#include "server/simulation/step_clock.hpp"

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

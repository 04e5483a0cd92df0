// Promise 3 for the joints of a real robot: commands are only ever reduced.
#pragma once

#include <vector>

#include "protocols/joints.hpp"
#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/physics/physics.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// See Simulation::limit_joints(), of a robot with a twin.
std::vector<Simulation::LimitedJoint> limit_joints(const RealRobot& robot, const Agents& agents,
                                                   const Physics& physics, double reaction, double holds,
                                                   Joints& command);

}  // namespace parhelion::simulation

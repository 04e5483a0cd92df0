// The cameras of simulated robots: jobs for the render thread.
#pragma once

#include <memory>
#include <vector>

#include "protocols/joints.hpp"
#include "protocols/robot.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/camera_path.hpp"
#include "server/tick/sensor_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// How a head that a sensor sits on is turned in a simulated robot's joints. Error: it lacks one of them.
Result<Transform<Base, Base>> simulated_head(const std::vector<HeadJoint>& head, const Joints& joints);

/// Of the trainee's simulated robot at the newest step: camera and depth camera at once, where both are due.
/// The colour of a point and its depth are of one instant.
void capture_images(const TickContext& context, const simulation::RobotMotion& motion,
                    const simulation::Simulation& simulation, const SiteState& site,
                    SimulatedSensors& sensors, CameraState& camera);

}  // namespace parhelion::tick

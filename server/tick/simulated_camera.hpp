// The cameras of simulated robots: creates jobs for the render thread.
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

/// Pose change of a movable sensor head from a simulated robot's joints. Error: one of the joints is missing.
Result<Transform<Base, Base>> simulated_head(const std::vector<HeadJoint>& head, const Joints& joints);

/// Captures the trainee's simulated robot's images at the newest step: camera and depth camera together,
/// where both are due, so that colour and depth have one stamp.
void capture_images(const TickContext& context, const simulation::RobotMotion& motion,
                    const simulation::Simulation& simulation, const SiteState& site,
                    SimulatedSensors& sensors, CameraState& camera);

}  // namespace parhelion::tick

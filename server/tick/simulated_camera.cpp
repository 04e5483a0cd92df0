#include "server/tick/simulated_camera.hpp"

#include <algorithm>

#include "fusion/pose/tracks/joint_track.hpp"

namespace parhelion::tick {

Result<Transform<Base, Base>> simulated_head(const std::vector<HeadJoint>& head, const Joints& joints) {
  const auto turn = pose::head_turn(head, [&joints](const std::string& joint) {
    const auto found = std::find(joints.names.begin(), joints.names.end(), joint);
    if (found == joints.names.end()) return std::optional<double>();
    return std::optional(joints.positions[static_cast<std::size_t>(found - joints.names.begin())]);
  });
  if (!turn) return turn.error();
  return *turn;
}

void capture_images(const TickContext& context, const simulation::RobotMotion& motion,
                    const simulation::Simulation& simulation, const SiteState& site,
                    SimulatedSensors& sensors, CameraState& camera) {
  const auto& described = context.configuration.robot.camera_at(camera.index);
  const auto& described_depth = context.configuration.robot.depth_at(camera.index);
  auto& depth_clock = sensors.cameras[camera.index].depth_clock;
  Outputs::Frame frame;
  render::RenderJob& job = frame.job;
  if (described) {
    const auto turn = simulated_head(described->head, motion.joints);
    if (!turn) return refuse(context, {"simulated camera: " + turn.error().message});
    job.camera = *described;
    job.T_map_optical = motion.T_map_base * *turn * described->T_base_optical;
  }
  if (described_depth && depth_clock->due(context.now - sensors.start)) {
    const auto turn = simulated_head(described_depth->head, motion.joints);
    if (!turn) return refuse(context, {"simulated depth camera: " + turn.error().message});
    job.depth_camera = *described_depth;
    job.T_map_depth = motion.T_map_base * *turn * described_depth->T_base_optical;
  }
  if (!simulation.at(context.now, job.world)) return;
  frame.sequence = record_number(context.robot_index, ++camera.sequence, camera.index);
  frame.camera = camera.index;
  job.image.stamp = {context.now.ns};
  frame.model = site.model;
  frame.exposure = {true, job.camera.noise, context.configuration.scenario.seed, frame.sequence};
  ++context.tally.frames_in;
  context.outputs.add_frame(std::move(frame));
}

}  // namespace parhelion::tick

// CAMERA to MR_CAMERA: a job for the render thread with the world at the image's instant, or the original
// with the reason. At levels 1 and 2 there is no CAMERA but what the render thread makes.
#include <algorithm>

#include "server/tick/agent_cameras.hpp"
#include "server/tick/sensor_path.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration depth_partner = milliseconds(50);  // further off in time it shows another moment
constexpr Duration same_moment = milliseconds(5);     // nearer than any two exposures of one camera
constexpr Duration longest_wait = milliseconds(50);   // for the depth image of the same moment

/// Through the render thread like all others, so that no original overtakes an image that is still drawn.
void pass_original(Image image, std::uint64_t sequence, const std::string& reason, Outputs& outputs) {
  Outputs::Frame frame;
  frame.job.image = std::move(image);
  frame.sequence = sequence;
  frame.reason = reason;
  outputs.add_frame(std::move(frame));
}

/// The occluders: depth image and current scan, each where it was measured from.
void add_occluders(const Configuration& configuration, State& state, render::RenderJob& job) {
  const RobotDescription& robot = configuration.robot;
  if (state.depth && robot.depth) {
    const Duration apart = job.image.stamp - state.depth->stamp;
    const auto pose = robot_pose(state, state.depth->stamp);
    const auto turn = pose::head_turn(robot.depth->head, state.joints, state.depth->stamp);
    if (pose && turn.ok() && std::abs(apart.ns) <= depth_partner.ns) {
      job.depth = state.depth;
      job.depth_camera = *robot.depth;
      job.T_map_depth = pose->T_map_base * Transform<Base, Base>(*turn) * robot.depth->T_base_optical;
    }
  }
  if (!state.scan.have_real || !robot.laser) return;
  const auto pose = robot_pose(state, state.scan.real.stamp);
  if (!pose) return;
  job.scan = state.scan.real;
  job.laser = *robot.laser;
  job.T_map_laser = pose->T_map_base * robot.laser->T_base_laser;
}

/// Agents whose place in the picture is not known well enough are not drawn, nor those that the scan leaves
/// out.
void leave_out_uncertain(const Configuration& configuration, const pose::PoseAtInstant& pose, State& state,
                         WorldSnapshot& world) {
  std::vector<BodyState>& bodies = world.bodies;
  std::vector<const BodyDefinition*> definitions;
  auto definition = world.scene->bodies.begin();
  for (const BodyState& body : bodies) {
    while ((*definition)->id < body.id) ++definition;
    definitions.push_back(definition->get());
  }
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < bodies.size(); begin = end) {
    double worst = 0;
    for (end = begin; end < bodies.size() && definitions[end]->entity == definitions[begin]->entity; ++end) {
      const double error = pose::predicted_error(pose, bodies[end].T_map_body.translation());
      if (!(error <= worst)) worst = error;
    }
    const bool shown = !definitions[begin]->injectable ||
                       state.gate.admit(definitions[begin]->entity, worst, world.stamp,
                                        configuration.scenario.injection, state.simulation);
    for (std::size_t i = begin; shown && i < end; ++i) bodies[kept++] = bodies[i];
  }
  bodies.resize(kept);
}

std::optional<Transform<Map, CameraOptical>> camera_at(const CameraDescription& camera, const State& state,
                                                       SensorTime t) {
  const auto pose = robot_pose(state, t);
  const auto turn = pose::head_turn(camera.head, state.joints, t);
  if (!pose || !turn) return std::nullopt;
  return pose->T_map_base * Transform<Base, Base>(*turn) * camera.T_base_optical;
}

/// Instant of the row in which a point is seen, from the stamp of the middle row; none behind the camera. The
/// lens' distortion is left out: it moves a point by few rows.
std::optional<Duration> row_instant(const CameraDescription& camera, const Eigen::Vector3d& p_optical) {
  constexpr double nearest = 0.05;  // m
  if (p_optical.z() < nearest) return std::nullopt;
  const double row = camera.intrinsics.fy * p_optical.y() / p_optical.z() + camera.intrinsics.cy;
  const double place = std::clamp(row / std::max(camera.intrinsics.height - 1, 1), 0.0, 1.0);
  return seconds((place - 0.5) * camera.readout);
}

/// A rolling shutter shows each body as it stood to the camera when its row was read. The picture is drawn
/// from where the camera was at the middle row, so the body is put where it looks the same from there.
void show_at_their_rows(const CameraDescription& camera, const State& state, render::RenderJob& job) {
  if (!(camera.readout > 0)) return;
  WorldSnapshot then;
  auto definition = job.world.scene->bodies.begin();
  for (BodyState& body : job.world.bodies) {
    while ((*definition)->id < body.id) ++definition;
    if (!(*definition)->injectable || (*definition)->shapes.empty()) continue;
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const Shape& shape : (*definition)->shapes) center += shape.T_body_shape.translation();
    center /= static_cast<double>((*definition)->shapes.size());
    const auto after = row_instant(camera, job.T_map_optical.inverse() * (body.T_map_body * center));
    if (!after) continue;
    const SensorTime t = job.image.stamp + *after;
    const auto T_map_optical = camera_at(camera, state, t);
    if (!T_map_optical || !state.simulation.at(state.robot_clock.to_server(t), then)) continue;
    const auto same = std::lower_bound(then.bodies.begin(), then.bodies.end(), body.id,
                                       [](const BodyState& each, BodyId id) { return each.id < id; });
    if (same == then.bodies.end() || same->id != body.id || same->epoch != body.epoch) continue;
    body.T_map_body = job.T_map_optical * T_map_optical->inverse() * same->T_map_body;
  }
}

void finish_image(const Configuration& configuration, State& state, Outputs& outputs) {
  WaitingImage waiting = std::move(*state.waiting_image);
  state.waiting_image.reset();
  render::RenderJob job;
  job.image = std::move(waiting.image);
  const auto original = [&](const std::string& reason) {
    pass_original(std::move(job.image), waiting.sequence, reason, outputs);
  };
  pose::NoPose why{};
  const auto pose = robot_pose(state, job.image.stamp, &why);
  if (!pose) return original(std::string("no pose: ") + to_string(why));
  const auto turn = pose::head_turn(configuration.robot.camera->head, state.joints, job.image.stamp);
  if (!turn) return original("camera head: " + turn.error().message);
  if (!state.simulation.at(state.robot_clock.to_server(job.image.stamp), job.world)) {
    return original("the world at the image's stamp is not known");
  }
  leave_out_uncertain(configuration, *pose, state, job.world);
  job.camera = *configuration.robot.camera;
  job.T_map_optical = pose->T_map_base * Transform<Base, Base>(*turn) * job.camera.T_base_optical;
  show_at_their_rows(job.camera, state, job);
  job.floor_z = 0;
  add_occluders(configuration, state, job);
  outputs.add_frame({std::move(job), waiting.sequence, state.model, "", {}, {}});
}

/// The depth image of the image's own moment, or a later one, is there.
bool depth_is_there(const State& state) {
  return state.depth && state.depth->stamp - state.waiting_image->image.stamp >= -same_moment;
}

/// Its bodies are in it already: MR_CAMERA is CAMERA and MR_DEPTH is DEPTH, as MR_SCAN is SCAN. Where nothing
/// could be rendered a camera is silent, and the report says why.
void add_picture(const Configuration& configuration, const render::RenderAnswer& answer, Outputs& outputs,
                 State& state) {
  const bool seen = !answer.image.bytes.empty();
  // The depth first: whoever waits for an image's depth has it when the image comes.
  for (const char* name : {channel::depth, channel::mr_depth})
    if (answer.depth) encode(*answer.depth, outputs.add(configuration.channels.bus(name)));
  for (const char* name : {channel::camera, channel::mr_camera})
    if (seen) encode(answer.image, outputs.add(configuration.channels.bus(name)));
  if (seen || answer.depth) ++state.tally.frames_out;
}

}  // namespace

Result<Transform<Base, Base>> simulated_head(const std::vector<HeadJoint>& head, const Joints& joints) {
  const auto turn = pose::head_turn(head, [&joints](const std::string& joint) {
    const auto found = std::find(joints.names.begin(), joints.names.end(), joint);
    if (found == joints.names.end()) return std::optional<double>();
    return std::optional(joints.positions[static_cast<std::size_t>(found - joints.names.begin())]);
  });
  if (!turn) return turn.error();
  return Transform<Base, Base>(*turn);
}

void answer_image(const Configuration& configuration, const Message& input, State& state, Outputs& outputs) {
  Image image;
  if (const Status read = decode(input.channel, input.payload, image); !read)
    return refuse(read.error(), state);
  ++state.tally.frames_in;
  const std::uint64_t sequence = ++state.frame_sequence;
  if (state.waiting_image) finish_image(configuration, state, outputs);
  if (!configuration.robot.camera) {
    return pass_original(std::move(image), sequence, "the robot description has no camera calibration",
                         outputs);
  }
  if (!state.robot_clock.add(input.arrival, image.stamp)) {
    return pass_original(std::move(image), sequence, "the stamp is off the robot's clock", outputs);
  }
  state.waiting_image = WaitingImage{std::move(image), sequence, simulation_time(input.arrival)};
  if (!configuration.robot.depth || depth_is_there(state)) finish_image(configuration, state, outputs);
}

/// Of both cameras at once, where both are due: the colour of a point and its depth are of one instant.
void take_picture(const Configuration& configuration, const simulation::RobotMotion& motion,
                  SimulationTime now, State& state, Outputs& outputs) {
  const RobotDescription& robot = configuration.robot;
  SimulatedSensors& sensors = *state.sensors;
  Outputs::Frame frame;
  render::RenderJob& job = frame.job;
  if (robot.camera) {
    const auto turn = simulated_head(robot.camera->head, motion.joints);
    if (!turn) return refuse({"simulated camera: " + turn.error().message}, state);
    job.camera = *robot.camera;
    job.T_map_optical = motion.T_map_base * *turn * robot.camera->T_base_optical;
  }
  if (robot.depth && sensors.depth_clock->due(now - sensors.start)) {
    const auto turn = simulated_head(robot.depth->head, motion.joints);
    if (!turn) return refuse({"simulated depth camera: " + turn.error().message}, state);
    job.depth_camera = *robot.depth;
    job.T_map_depth = motion.T_map_base * *turn * robot.depth->T_base_optical;
  }
  if (!state.simulation.at(now, job.world)) return;
  frame.sequence = ++state.frame_sequence;
  job.image.stamp = {now.ns};
  frame.model = state.model;
  frame.exposure = {true, job.camera.noise, configuration.scenario.seed, frame.sequence};
  ++state.tally.frames_in;
  outputs.add_frame(std::move(frame));
}

void flush_images(const Configuration& configuration, State& state, Outputs& outputs) {
  if (state.waiting_image) finish_image(configuration, state, outputs);
}

void watch_waiting_image(const Configuration& configuration, SimulationTime now, State& state,
                         Outputs& outputs) {
  if (state.waiting_image && now - state.waiting_image->arrival >= longest_wait) {
    finish_image(configuration, state, outputs);
  }
}

void add_frame_outputs(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                       State& state) {
  if (!done.agent.empty()) return publish_agent_picture(configuration, done, outputs, state);
  if (done.simulated) return add_picture(configuration, done.answer, outputs, state);
  encode(done.answer.image, outputs.add(configuration.channels.bus(channel::mr_camera)));
  if (done.answer.depth)
    encode(*done.answer.depth, outputs.add(configuration.channels.bus(channel::mr_depth)));
  ++state.tally.frames_out;
  if (done.answer.drawn) ++state.tally.frames_composited;
}

void take_depth(const Configuration& configuration, const Message& input, State& state, Outputs& outputs) {
  Image depth;
  if (const Status read = decode(input.channel, input.payload, depth); !read)
    return refuse(read.error(), state);
  state.depth = std::move(depth);
  if (state.waiting_image && depth_is_there(state)) finish_image(configuration, state, outputs);
}

}  // namespace parhelion::tick

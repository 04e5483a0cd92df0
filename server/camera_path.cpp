// CAMERA to MR_CAMERA: a job for the render thread with the world at the image's instant, or the original
// with the reason.
#include "server/tick.hpp"

namespace parhelion {
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
void add_occluders(const Configuration& configuration, State& state, RenderJob& job) {
  const RobotDescription& robot = configuration.robot;
  if (state.depth && robot.depth) {
    const Duration apart = job.image.stamp - state.depth->stamp;
    const auto pose = robot_pose(state, state.depth->stamp);
    const auto turn = head_turn(robot.depth->head, state.joints, state.depth->stamp);
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

/// Agents whose place in the picture is not known well enough are not drawn (as in the scan).
void leave_out_uncertain(const Configuration& configuration, const PoseAtInstant& pose, State& state,
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
      const double error = predicted_error(pose, bodies[end].T_map_body.translation());
      if (!(error <= worst)) worst = error;
    }
    const bool shown = !definitions[begin]->injectable ||
                       state.gate.admit(definitions[begin]->entity, worst, world.stamp,
                                        configuration.scenario.injection, state.simulation);
    for (std::size_t i = begin; shown && i < end; ++i) bodies[kept++] = bodies[i];
  }
  bodies.resize(kept);
}

void finish_image(const Configuration& configuration, State& state, Outputs& outputs) {
  WaitingImage waiting = std::move(*state.waiting_image);
  state.waiting_image.reset();
  RenderJob job;
  job.image = std::move(waiting.image);
  const auto original = [&](const std::string& reason) {
    pass_original(std::move(job.image), waiting.sequence, reason, outputs);
  };
  NoPose why{};
  const auto pose = robot_pose(state, job.image.stamp, &why);
  if (!pose) return original(std::string("no pose: ") + to_string(why));
  const auto turn = head_turn(configuration.robot.camera->head, state.joints, job.image.stamp);
  if (!turn) return original("camera head: " + turn.error().message);
  if (!state.simulation.at(state.robot_clock.to_server(job.image.stamp), job.world)) {
    return original("the world at the image's stamp is not known");
  }
  leave_out_uncertain(configuration, *pose, state, job.world);
  job.camera = *configuration.robot.camera;
  job.T_map_optical = pose->T_map_base * Transform<Base, Base>(*turn) * job.camera.T_base_optical;
  job.floor_z = 0;
  add_occluders(configuration, state, job);
  outputs.add_frame({std::move(job), waiting.sequence, ""});
}

/// The depth image of the image's own moment, or a later one, is there.
bool depth_is_there(const State& state) {
  return state.depth && state.depth->stamp - state.waiting_image->image.stamp >= -same_moment;
}

}  // namespace

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

}  // namespace parhelion

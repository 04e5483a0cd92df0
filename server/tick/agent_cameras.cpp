#include "server/tick/agent_cameras.hpp"

#include <algorithm>

#include "protocols/channel_map.hpp"
#include "protocols/yaml/quantity.hpp"

namespace parhelion::tick {
namespace {

/// The numbers of these pictures, apart from those of the robot's camera: a LOOP record names either kind,
/// and the noise depends on them.
constexpr std::uint64_t first_sequence = std::uint64_t{1} << 32;
constexpr double usual_rate = 15;  // Hz, of a camera whose description says none

std::string hertz(double rate) { return yaml::format_quantity(rate, yaml::Quantity::rate); }

Result<const CameraDescription*> camera_of(const Configuration& configuration, const AgentDefinition& agent) {
  const auto& models = configuration.robot_models;
  const auto model =
      std::find_if(models.begin(), models.end(), [&](const auto& each) { return each->name == agent.model; });
  if (model == models.end())
    return Error{"the camera of '" + agent.name +
                 "' would be its robot model's, and it has none; give it a "
                 "'model', such as 'rover'"};
  const auto& camera = (*model)->description.camera;
  if (!camera)
    return Error{"robot model '" + agent.model + "' of '" + agent.name +
                 "' has no camera; add a 'camera' to its 'robot' section"};
  const double most = camera->rate > 0 ? camera->rate : usual_rate;
  if (agent.camera_rate > most)
    return Error{"the camera of robot model '" + agent.model + "' takes " + hertz(most) + ", and '" +
                 agent.name + "' asks for " + hertz(agent.camera_rate)};
  return &*camera;
}

}  // namespace

Status check_agent_camera(const Configuration& configuration, const AgentDefinition& agent,
                          const State& state) {
  if (agent.camera_rate == 0) return {};
  if (!(agent.camera_rate > 0))
    return Error{"the camera of '" + agent.name + "' cannot take " + hertz(agent.camera_rate) +
                 "; expected pictures a second, or 0 for none"};
  if (const auto camera = camera_of(configuration, agent); !camera) return camera.error();
  double others = 0;
  if (state.agent_cameras) {
    for (const AgentCamera& each : state.agent_cameras->cameras)
      others += each.agent == agent.name ? 0 : each.rate;
  }
  const double most = configuration.scenario.most_agent_pictures;
  if (others + agent.camera_rate <= most) return {};
  return Error{"the cameras of agents take " + hertz(others) + ", and '" + agent.name + "' asks for " +
               hertz(agent.camera_rate) + " more; together at most " + hertz(most) +
               " (the scenario's most_agent_pictures)"};
}

Status set_agent_camera(const Configuration& configuration, const AgentDefinition& agent, State& state) {
  if (const Status fits = check_agent_camera(configuration, agent, state); !fits) return fits;
  if (!state.agent_cameras) state.agent_cameras = std::make_unique<AgentCameras>();
  std::vector<AgentCamera>& cameras = state.agent_cameras->cameras;
  std::erase_if(cameras, [&](const AgentCamera& each) { return each.agent == agent.name; });
  if (agent.camera_rate == 0) return {};
  cameras.push_back({agent.name, **camera_of(configuration, agent), agent.camera_rate, state.simulation.now(),
                     Cadence(agent.camera_rate)});
  return {};
}

void forget_agent_cameras(State& state) {
  if (!state.agent_cameras) return;
  std::erase_if(state.agent_cameras->cameras,
                [&](const AgentCamera& each) { return state.simulation.find_agent(each.agent) == nullptr; });
}

void take_agent_picture(const Configuration& configuration, SimulationTime now, State& state,
                        Outputs& outputs) {
  if (!state.agent_cameras) return;
  auto& [cameras, taken] = *state.agent_cameras;
  const auto due = std::find_if(cameras.begin(), cameras.end(),
                                [now](AgentCamera& each) { return each.clock.due(now - each.start); });
  if (due == cameras.end()) return;
  std::rotate(due, due + 1, cameras.end());  // the others are asked before it the next time
  const AgentCamera& camera = cameras.back();
  const simulation::RobotMotion* motion = state.simulation.robot_motion(camera.agent);
  if (motion == nullptr) return;
  Outputs::Frame frame;
  render::RenderJob& job = frame.job;
  job.camera = camera.camera;
  const auto turn = simulated_head(job.camera.head, motion->joints);
  if (!turn) return refuse({"the camera of '" + camera.agent + "': " + turn.error().message}, state);
  job.T_map_optical = motion->T_map_base * *turn * job.camera.T_base_optical;
  if (!state.simulation.at(now, job.world)) return;
  job.image.stamp = {now.ns};
  frame.agent = camera.agent;
  frame.sequence = first_sequence + ++taken;
  frame.model = state.model;
  frame.exposure = {true, job.camera.noise, configuration.scenario.seed, frame.sequence};
  ++state.tally.agent_frames_in;
  outputs.add_frame(std::move(frame));
}

void publish_agent_picture(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                           State& state) {
  if (done.answer.image.bytes.empty()) return;
  encode(done.answer.image, outputs.add(configuration.channels.bus(agent_camera_channel(done.agent))));
  ++state.tally.agent_frames_out;
}

}  // namespace parhelion::tick

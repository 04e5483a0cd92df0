#include "server/tick/agent_cameras.hpp"

#include <algorithm>

#include "protocols/yaml/quantity.hpp"
#include "server/tick/simulated_camera.hpp"

namespace parhelion::tick {
namespace {

/// Frame numbers of agents' cameras are separate from the robot camera's: a LOOP record names either kind,
/// and the noise depends on them.
constexpr std::uint64_t kFirstSequence = std::uint64_t{1} << 32;
constexpr double kUsualRate = 15;  // Hz, if the description gives none

std::string hertz(double rate) { return yaml::format_quantity(rate, yaml::Quantity::rate); }

Result<const CameraDescription*> camera_of(const Configuration& configuration, const AgentDefinition& agent) {
  const auto& models = configuration.robot_models;
  const auto model =
      std::find_if(models.begin(), models.end(), [&](const auto& each) { return each->name == agent.model; });
  if (model == models.end())
    return Error{"'" + agent.name +
                 "' has no robot model, and so no camera; give it a 'model', such as 'rover'"};
  const auto& camera = (*model)->description.camera;
  if (!camera)
    return Error{"robot model '" + agent.model + "' of '" + agent.name +
                 "' has no camera; add a 'camera' to its 'robot' section"};
  const double rate_limit = camera->rate > 0 ? camera->rate : kUsualRate;
  if (agent.camera_rate > rate_limit)
    return Error{"the camera of robot model '" + agent.model + "' takes " + hertz(rate_limit) + ", and '" +
                 agent.name + "' asks for " + hertz(agent.camera_rate)};
  return &*camera;
}

}  // namespace

Status check_agent_camera(const Configuration& configuration, const AgentDefinition& agent,
                          const AgentCameras& cameras) {
  if (agent.camera_rate == 0) return {};
  if (!(agent.camera_rate > 0))
    return Error{"the camera of '" + agent.name + "' cannot take " + hertz(agent.camera_rate) +
                 "; expected a rate in Hz, or 0 for none"};
  if (const auto camera = camera_of(configuration, agent); !camera) return camera.error();
  double others = 0;
  for (const AgentCamera& each : cameras.cameras) others += each.agent == agent.name ? 0 : each.rate;
  const double rate_limit = configuration.scenario.max_agent_image_rate;
  if (others + agent.camera_rate <= rate_limit) return {};
  return Error{"the cameras of agents use " + hertz(others) + ", and '" + agent.name + "' asks for " +
               hertz(agent.camera_rate) + " more; together at most " + hertz(rate_limit) +
               " (the scenario's max_agent_image_rate)"};
}

Status set_agent_camera(const Configuration& configuration, const AgentDefinition& agent, SimulationTime now,
                        AgentCameras& cameras) {
  if (const Status fits = check_agent_camera(configuration, agent, cameras); !fits) return fits;
  std::erase_if(cameras.cameras, [&](const AgentCamera& each) { return each.agent == agent.name; });
  if (agent.camera_rate == 0) return {};
  cameras.cameras.push_back(
      {agent.name, **camera_of(configuration, agent), agent.camera_rate, now, Cadence(agent.camera_rate)});
  return {};
}

void forget_agent_cameras(const simulation::Simulation& simulation, AgentCameras& cameras) {
  std::erase_if(cameras.cameras,
                [&](const AgentCamera& each) { return simulation.find_agent(each.agent) == nullptr; });
}

void capture_agent_images(const TickContext& context, const simulation::Simulation& simulation,
                          const SiteState& site, AgentCameras& agent_cameras) {
  auto& [cameras, taken] = agent_cameras;
  const SimulationTime now = context.now;
  const auto due = std::find_if(cameras.begin(), cameras.end(),
                                [now](AgentCamera& each) { return each.clock.due(now - each.start); });
  if (due == cameras.end()) return;
  std::rotate(due, due + 1, cameras.end());  // the other cameras come first next time
  const AgentCamera& camera = cameras.back();
  const simulation::RobotMotion* motion = simulation.robot_motion(camera.agent);
  if (motion == nullptr) return;
  Outputs::Frame frame;
  render::RenderJob& job = frame.job;
  job.camera = camera.camera;
  const auto turn = simulated_head(job.camera.head, motion->joints);
  if (!turn) return refuse(context, {"the camera of '" + camera.agent + "': " + turn.error().message});
  job.T_map_optical = motion->T_map_base * *turn * job.camera.T_base_optical;
  if (!simulation.at(now, job.world)) return;
  job.image.stamp = {now.ns};
  frame.agent = camera.agent;
  frame.sequence = kFirstSequence + ++taken;
  frame.model = site.model;
  frame.exposure = {true, job.camera.noise, context.configuration.scenario.seed, frame.sequence};
  ++context.tally.agent_frames_in;
  context.outputs.add_frame(std::move(frame));
}

}  // namespace parhelion::tick

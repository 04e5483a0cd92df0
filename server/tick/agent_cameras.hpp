// The cameras of agents: which of them send pictures, how often, and when the next is due. It is decided by
// the scenario and by commands alone, so that replay makes the same ones.
#pragma once

#include <string>
#include <vector>

#include "protocols/command.hpp"
#include "protocols/robot.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/cadence.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct AgentCamera {
  std::string agent;
  CameraDescription camera;  ///< of its robot model
  double rate = 0;           ///< Hz
  SimulationTime start;
  Cadence clock{1};
};

struct AgentCameras {
  std::vector<AgentCamera> cameras;  ///< who took a picture last is last
  std::uint64_t taken = 0;
};

/// Whether such an agent's camera can take its pictures beside those that there are. Error: its robot model
/// is not known, has no camera or a slower one; or the cameras of all would take more than the scenario's
/// most_agent_pictures.
Status check_agent_camera(const Configuration& configuration, const AgentDefinition& agent,
                          const AgentCameras& cameras);
/// From now on an agent that exists sends agent.camera_rate pictures a second; 0: none any more. Error: as
/// check_agent_camera().
Status set_agent_camera(const Configuration& configuration, const AgentDefinition& agent, SimulationTime now,
                        AgentCameras& cameras);
/// Of agents that are not there any more.
void forget_agent_cameras(const simulation::Simulation& simulation, AgentCameras& cameras);
/// At the newest step: a job for the render thread, if a picture is due. One at a step, so that cameras of
/// one rate do not hold up a step together.
void capture_agent_images(const TickContext& context, const simulation::Simulation& simulation,
                          const SiteState& site, AgentCameras& cameras);

}  // namespace parhelion::tick

// Cameras of agents: which of them publish images, at what rate, and when the next image is due. This depends
// only on the scenario and on commands, so replay produces the same images.
#pragma once

#include <string>
#include <vector>

#include "protocols/agent.hpp"
#include "protocols/robot.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/cadence.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct AgentCamera {
  std::string agent;
  CameraDescription camera;  ///< of the agent's robot model
  double rate = 0;           ///< Hz
  SimulationTime start;
  Cadence clock{1};
};

struct AgentCameras {
  std::vector<AgentCamera> cameras;  ///< least recently used first
  std::uint64_t taken = 0;
};

/// Checks that an agent's camera can run beside the existing ones. Error: the agent's robot model is unknown,
/// has no camera or a slower one, or all cameras together would exceed the scenario's max_agent_image_rate.
Status check_agent_camera(const Configuration& configuration, const AgentDefinition& agent,
                          const AgentCameras& cameras);
/// Sets the rate of an existing agent's camera to agent.camera_rate images a second; 0 switches it off.
/// Error: as check_agent_camera().
Status set_agent_camera(const Configuration& configuration, const AgentDefinition& agent, SimulationTime now,
                        AgentCameras& cameras);
/// Removes the cameras of agents that no longer exist.
void forget_agent_cameras(const simulation::Simulation& simulation, AgentCameras& cameras);
/// Adds a job for the render thread if an image is due at the newest step. At most one per step, so that
/// cameras with the same rate do not delay a step together.
void capture_agent_images(const TickContext& context, const simulation::Simulation& simulation,
                          const SiteState& site, AgentCameras& cameras);

}  // namespace parhelion::tick

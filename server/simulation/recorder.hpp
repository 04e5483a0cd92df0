// Records the states and motions of all bodies at each step in the history, and reads them back.
#pragma once

#include <memory>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/world.hpp"
#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/bodies/step_clock.hpp"
#include "server/simulation/history.hpp"
#include "server/simulation/world/environment.hpp"

namespace parhelion::simulation {

class Recorder {
 public:
  /// Keeps `records` steps.
  explicit Recorder(std::size_t records) : history_(records) {}

  /// Updates the scene's version; call after a body was added or removed.
  void rebuild_scene(const Environment& environment, const RealRobots& real_robots, const Agents& agents);
  const std::shared_ptr<const Scene>& scene() const { return scene_; }

  /// Records the newest step.
  void record(const StepClock& clock, const Environment& environment, const RealRobots& real_robots,
              Agents& agents);
  /// See Simulation::at(); `ahead`: how far beyond the newest step is extrapolated.
  bool at(SimulationTime t, Duration ahead, WorldSnapshot& snapshot) const;

 private:
  void append_states(Agent& agent, double dt, std::vector<BodyState>& bodies);

  std::shared_ptr<const Scene> scene_;
  History history_;
  std::vector<Transform<Base, Body>> poses_;  // reused memory
};

}  // namespace parhelion::simulation

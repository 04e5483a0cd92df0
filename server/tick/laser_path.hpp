// Simulated lasers: cast in the building and against all bodies but their own, as this type measures. Those
// of a step are cast by several threads; what is done with the scans is done in the order of the requests.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fusion/scan/augment.hpp"
#include "fusion/scan/ray_caster.hpp"
#include "protocols/scan.hpp"
#include "protocols/world.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/executor.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// All that any laser of a step may meet, over a sweep that began at `start`.
struct SweptWorld {
  SimulationTime start;
  std::vector<scan::BodyMotion> motions;
  std::vector<scan::BodyGroup> groups;  ///< of each agent
};

/// What one thread casts a simulated laser with.
struct LaserScratch {
  scan::RayCaster caster;
  std::vector<float> beam_time;
  std::vector<scan::BodyGroup> groups;  ///< all but its own
  std::vector<scan::RangeHit> body_hits, building_hits;
};

/// A simulated laser that is to be cast: reads the state, and writes to its scratch and scan alone.
struct LaserJob {
  const simulation::LaserRequest* request = nullptr;
  std::size_t sweep = 0;  ///< of LaserState::sweeps
  scan::LaserMotion laser;
  scan::NoiseKey key;
  SensorTime stamp;
};

/// The simulated lasers of agents, and of the trainee's robot where it is simulated.
struct LaserState {
  explicit LaserState(std::unique_ptr<Executor> executor);

  std::unique_ptr<Executor> executor;
  std::vector<simulation::LaserRequest> requests;  ///< that fell due at the newest step
  WorldSnapshot world_start, world_end;
  SimulationTime swept;            ///< end of...
  std::vector<SweptWorld> sweeps;  ///< ...these, of which...
  std::size_t sweep_count = 0;     ///< ...so many are of this step
  std::uint64_t sequence = 0;
  std::vector<LaserJob> jobs;
  std::vector<Scan> scans;            ///< of each job
  std::vector<LaserScratch> scratch;  ///< one for each thread; of a laser that is cast alone the first
};

/// What the laser measures at the newest step, the scan's stamp being the last beam's; its hits are left in
/// the first scratch, of bodies of its only job's sweep. False: the world at that instant is not known.
bool simulate_laser(const Configuration& configuration, const simulation::LaserRequest& request,
                    const simulation::Simulation& simulation, const scan::RayCaster& building,
                    LaserState& lasers, Scan& scan);

/// The scans of all requests, for the agents' behaviour and for MR_AGENT_<name>_SCAN.
void publish_agent_scans(const TickContext& context, const scan::RayCaster& building,
                         simulation::Simulation& simulation, LaserState& lasers);

}  // namespace parhelion::tick

// Simulated lasers: cast in the building and against all bodies but their own, with the laser's measurement
// model. Those of one step are cast in parallel; the scans are used in the order of the requests.
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

/// Everything that any laser of a step can hit, over a sweep that began at `start`.
struct SweptWorld {
  SimulationTime start;
  std::vector<scan::BodyMotion> motions;
  std::vector<scan::BodyGroup> groups;  ///< one per agent
};

/// One thread's scratch for casting a simulated laser.
struct LaserScratch {
  scan::RayCaster caster;
  std::vector<float> beam_time;
  std::vector<scan::BodyGroup> groups;  ///< all except its own
  std::vector<scan::RangeHit> body_hits, building_hits;
};

/// A simulated laser to cast: reads the state, and writes only to its scratch and scan.
struct LaserJob {
  const simulation::LaserRequest* request = nullptr;
  std::size_t sweep = 0;  ///< index in LaserState::sweeps
  scan::LaserMotion laser;
  scan::NoiseKey key;
  SensorTime stamp;
};

/// The simulated lasers of agents, and of the trainee's robot where it is simulated.
struct LaserState {
  explicit LaserState(std::unique_ptr<Executor> executor);

  std::unique_ptr<Executor> executor;
  std::vector<simulation::LaserRequest> requests;  ///< due at the newest step
  WorldSnapshot world_start, world_end;
  SimulationTime swept;            ///< end of `sweeps`
  std::vector<SweptWorld> sweeps;  ///< one per distinct start of a sweep
  std::size_t sweep_count = 0;     ///< number of sweeps of this step
  std::uint64_t sequence = 0;
  std::vector<LaserJob> jobs;
  std::vector<Scan> scans;            ///< one per job
  std::vector<LaserScratch> scratch;  ///< one per thread; a laser cast alone uses the first
};

/// Casts the laser at the newest step; the scan's stamp is that of the last beam. Its hits stay in the first
/// scratch and refer to the bodies of its only job's sweep. False: the world at that instant is not known.
bool simulate_laser(const Configuration& configuration, const simulation::LaserRequest& request,
                    const simulation::Simulation& simulation, const scan::RayCaster& building,
                    LaserState& lasers, Scan& scan);

/// Casts all requests, for the agents' behaviour and for MR_AGENT_<name>_SCAN.
void publish_agent_scans(const TickContext& context, const scan::RayCaster& building,
                         simulation::Simulation& simulation, LaserState& lasers);

}  // namespace parhelion::tick

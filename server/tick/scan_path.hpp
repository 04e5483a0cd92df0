// SCAN to MR_SCAN and MR_SCAN_INFO: the world at the scan's stamp, cast beam by beam, injected according to
// promise 1.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fusion/scan/augment.hpp"
#include "fusion/scan/sweep_rays.hpp"
#include "fusion/scan/unexplained.hpp"
#include "protocols/bus/bus.hpp"
#include "protocols/scan.hpp"
#include "protocols/telemetry.hpp"
#include "protocols/world.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/beam_watch.hpp"
#include "server/tick/door_tracker.hpp"
#include "server/tick/injection_path.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/people_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scan_watch.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// The newest scan of one laser and its result. The buffers keep their capacity after the first scans.
struct ScanState {
  std::size_t laser = 0;   ///< index in the robot, see RobotDescription::laser_at()
  std::size_t sensor = 0;  ///< number among all sensors of all robots
  std::uint64_t sequence = 0;
  std::uint64_t degraded = 0;  ///< scans published unchanged
  Scan real, out;
  bool have_real = false;
  std::vector<float> beam_time;  ///< of each beam, 0..1 of the sweep
  std::vector<scan::RangeHit> virtual_hits, building_hits;
  bool building_cast = false;             ///< building_hits are those of this scan
  std::vector<scan::BodyMotion> motions;  ///< bodies to inject
  std::vector<scan::BodyMotion> doors;    ///< real bodies that move: parts of the building, and other robots
  std::vector<std::int32_t> beam_body;
  struct AgentOfBody {
    std::size_t first;   ///< index in motions of the agent's first body
    std::int16_t named;  ///< index in info.agents, at that body; -1: none yet
  };
  std::vector<AgentOfBody> agents;  ///< scratch, by index in motions
  WorldSnapshot world_start, world_end;
  ScanInfo info;
  std::vector<std::uint8_t> mr_scan;  ///< encoded

  scan::UnexplainedReturns unexplained;
  std::vector<simulation::RealObstacle>
      obstacles;                  ///< real objects that the model does not explain, such as people
  SimulationTime obstacles_seen;  ///< arrival of the scan that showed them

  scan::SweepRays rays;  ///< scratch

  ScanWatch watch;
  BeamWatch beams;

  std::optional<Scan> line;  ///< the newest of LINES
};

/// A planar laser of a robot after its first. Its scans are answered like those of the first, with the
/// robot's pose, clock and gate, and show people, obstacles and doors like them; only the pose is refined by
/// the first alone.
struct FurtherLaser {
  ScanState scan;
  ScanInjection injection;
  PeopleState people;
};

/// Dependencies of the scan path.
struct ScanPath {
  PoseState& pose;
  ScanState& scan;
  ScanInjection& injection;
  InjectionGate& gate;
  SiteState& site;
  PeoplePath people;
  DoorTracker& doors;
  simulation::Simulation& simulation;
  const RealRobots& real;
};

/// Of a scan: injected, or why it goes out as it came.
struct ScanOutcome {
  Degraded cause = Degraded::none;
  std::string text;  ///< empty where injected
};

/// The robot and the world at the first and last beam; valid where the scan was injected into, or could have
/// been but for its predicted error (Degraded::error).
struct SweepPoses {
  pose::PoseAtInstant start, end;
  scan::LaserMotion laser;
};

/// As described, or as its scans have shown it to be (BeamWatch).
const LaserDescription& laser_of(const TickContext& context, const ScanState& scan);

/// Computes MR_SCAN, passes it to the sink, and then uses the scan for the server's own state (people,
/// obstacles missing in the model, door angles), in this order.
void process_scan(const TickContext& context, const Message& input, const ScanPath& path, ScanSink& sink,
                  StageObserver& stages);

/// LINES does not affect the tick: the newest is kept for the mapper.
void handle_line(const TickContext& context, const Message& input, ScanState& scan);

}  // namespace parhelion::tick

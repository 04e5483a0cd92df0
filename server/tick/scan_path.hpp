// SCAN to MR_SCAN and MR_SCAN_INFO: the world at the scan's own instant, cast beam by beam, injected as
// promise 1 says.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fusion/scan/augment.hpp"
#include "fusion/scan/unexplained.hpp"
#include "protocols/bus/bus.hpp"
#include "protocols/scan.hpp"
#include "protocols/telemetry.hpp"
#include "protocols/world.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/door_tracker.hpp"
#include "server/tick/injection_path.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// The newest scan and its answer. The buffers are warm after the first scans.
struct ScanState {
  std::uint64_t sequence = 0;
  Scan real, out;
  bool have_real = false;
  std::vector<float> beam_time;
  std::vector<scan::RangeHit> virtual_hits, building_hits;
  bool building_cast = false;                    ///< building_hits hold for this scan
  std::vector<scan::BodyMotion> motions, doors;  ///< what may be injected; what moves of the building
  std::vector<std::int32_t> beam_body;
  WorldSnapshot world_start, world_end;
  ScanInfo info;
  std::vector<std::uint8_t> mr_scan;  ///< encoded

  scan::UnexplainedReturns unexplained;
  std::vector<simulation::RealObstacle> obstacles;  ///< people, for one: what the model does not explain
  SimulationTime obstacles_seen;                    ///< arrival of the scan that showed them

  std::optional<Scan> line;  ///< of LINES, the newest
};

/// What the scan path works on.
struct ScanPath {
  PoseState& pose;
  ScanState& scan;
  InjectionState& injection;
  SiteState& site;
  DoorTracker& doors;
  simulation::Simulation& simulation;
};

/// In this order: MR_SCAN is computed, the sink gets it, and the server learns from the scan (obstacles that
/// the model lacks, angles of doors).
void process_scan(const TickContext& context, const Message& input, const ScanPath& path, ScanSink& sink,
                  StageObserver& stages);

/// LINES changes nothing in the tick: the newest is for whoever maps.
void handle_line(const TickContext& context, const Message& input, ScanState& scan);

/// At each step: obstacles that no scan has shown for a while are gone.
void forget_old_obstacles(SimulationTime now, ScanState& scan, simulation::Simulation& simulation);

}  // namespace parhelion::tick

#include "server/tick/scan_learning.hpp"

#include "server/tick/other_robots.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration kObstacleLife = seconds(1.0);  // people move: obstacles not seen for longer are removed

/// Real returns that the model does not explain become obstacles for agents, such as people.
void update_obstacles(const TickContext& context, const SweepPoses& poses, double sigma,
                      const ScanPath& path) {
  ScanState& scan = path.scan;
  const scan::BeamSet beams = scan::beam_set(scan.real, scan.beam_time);
  const LaserDescription& laser = laser_of(context, scan);
  if (!scan.building_cast)
    path.site.caster.cast_building(poses.laser, beams, scan.doors, laser.convention.range_max,
                                   scan.building_hits);
  explain_by_other_robots(context, poses.laser, path);
  const SimulationTime taken = path.pose.clock.to_server(scan.real.stamp);
  track_people(context,
               {0, scan.real, laser, poses.laser, scan.beam_time, scan.building_hits, sigma, taken, {}},
               path.real, path.people);
  scan.obstacles.clear();
  for (const scan::UnexplainedDisc& disc :
       scan.unexplained.find(scan.real, laser, poses.laser, scan.beam_time, scan.building_hits, sigma)) {
    if (!near_person(path.people.bystanders, disc.center))
      scan.obstacles.push_back({disc.center, disc.radius});
  }
  scan.obstacles_seen = context.now;
  path.simulation.set_real_obstacles(scan.obstacles, scan.sensor);
}

/// Where the poses of the sweep are known: people, obstacles, and door angles.
void learn_from_returns(const TickContext& context, const ScanOutcome& outcome, const SweepPoses& poses,
                        const ScanPath& path) {
  // The pose may be known although no agent can be injected.
  if (outcome.cause != Degraded::none && outcome.cause != Degraded::error) return;
  const double sigma = pose::predicted_error(poses.end, poses.laser.T_map_laser_end.translation());
  // Without a model everything real is unexplained, and people cannot be told from walls.
  if (outcome.cause == Degraded::none && !current_model(context.configuration, path.site).entities.empty())
    update_obstacles(context, poses, sigma, path);
  update_door_angles(context,
                     {path.scan.sensor, path.scan.real, laser_of(context, path.scan), path.scan.beam_time,
                      poses.laser, sigma},
                     path.doors, path.simulation);
}

}  // namespace

void learn_from_scan(const TickContext& context, const ScanOutcome& outcome, const SweepPoses& poses,
                     const ScanPath& path) {
  ScanState& scan = path.scan;
  const std::string& name = path.injection.laser;
  if (scan.have_real) watch_scans(context, scan.real, scan.laser, name, scan.watch);
  report_injection(context, outcome.text, path.injection);
  learn_from_returns(context, outcome, poses, path);
  if (scan.have_real) watch_beam_order(context, scan.real, scan.laser, name, path.pose, scan.beams);
}

void forget_old_obstacles(const TickContext& context, ScanState& scan, simulation::Simulation& simulation) {
  if (scan.obstacles.empty() || context.now - scan.obstacles_seen <= kObstacleLife) return;
  scan.obstacles.clear();
  simulation.set_real_obstacles(scan.obstacles, scan.sensor);
}

}  // namespace parhelion::tick

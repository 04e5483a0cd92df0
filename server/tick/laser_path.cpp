// Simulated lasers: cast in the building and against all bodies but their own, as this type measures. Those
// of a step are cast by several threads; what is done with the scans is done in the order of the requests.
#include "server/tick/bodies_in_sweep.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

/// All that a laser with this sweep may meet; shared by those of a step that sweep alike. Nothing: the world
/// is not known.
std::optional<std::size_t> bring_sweep(SimulationTime start, SimulationTime end, State& state) {
  AgentScanPath& own = state.agent_laser;
  if (own.swept != end) own.sweep_count = 0;
  own.swept = end;
  for (std::size_t i = 0; i < own.sweep_count; ++i) {
    if (own.sweeps[i].start == start) return i;
  }
  const auto holds = [](const WorldSnapshot& world, SimulationTime t) {
    return world.scene && world.stamp == t;
  };
  if (!holds(own.world_end, end) && !state.simulation.at(end, own.world_end)) return std::nullopt;
  if (!state.simulation.at(start, own.world_start)) own.world_start = own.world_end;
  if (own.sweeps.size() == own.sweep_count) own.sweeps.emplace_back();
  SweptWorld& sweep = own.sweeps[own.sweep_count];
  sweep.start = start;
  bodies_in_sweep(own.world_start, own.world_end, sweep.motions,
                  [](const BodyDefinition& body, const BodyState&) { return is_cast_as_body(body); });
  group_bodies(sweep.motions, sweep.groups);
  return own.sweep_count++;
}

/// Where the laser was at both ends of its sweep, by how the body that carries it moved.
scan::LaserMotion laser_motion(const simulation::LaserRequest& request, const SweptWorld& sweep) {
  scan::LaserMotion laser{request.T_map_laser, request.T_map_laser};
  const auto carrier = std::lower_bound(
      sweep.motions.begin(), sweep.motions.end(), request.own_bodies.front(),
      [](const scan::BodyMotion& motion, BodyId wanted) { return motion.body->id < wanted; });
  if (carrier == sweep.motions.end() || carrier->body->id != request.own_bodies.front()) return laser;
  laser.T_map_laser_start =
      carrier->T_map_body_start * (carrier->T_map_body_end.inverse() * request.T_map_laser);
  return laser;
}

/// The job of a request. Noise is keyed apart from the real scans, whose sequence numbers stay below 2^32.
std::optional<LaserJob> job_of(const Configuration& configuration, const simulation::LaserRequest& request,
                               State& state) {
  AgentScanPath& own = state.agent_laser;
  const scan::Sweep sweep = scan::beam_times(request.laser, static_cast<std::size_t>(request.laser.beams),
                                             own.benches.front().beam_time);
  const auto swept = bring_sweep(request.stamp - (sweep.end - sweep.start), request.stamp, state);
  if (!swept) return std::nullopt;
  return LaserJob{
      &request,
      *swept,
      laser_motion(request, own.sweeps[*swept]),
      {configuration.scenario.seed, (std::uint64_t{request.own_bodies.front()} + 1) << 32 | ++own.sequence},
      {request.stamp.ns - sweep.end.ns}};
}

void cast(const LaserJob& job, const SweptWorld& sweep, const scan::RayCaster& building, LaserBench& bench,
          Scan& scan) {
  const LaserDescription& laser = job.request->laser;
  const auto beams = static_cast<std::size_t>(laser.beams);
  scan::beam_times(laser, beams, bench.beam_time);
  const scan::BeamSet set{static_cast<float>(laser.angle_first), static_cast<float>(laser.angle_step),
                          bench.beam_time};
  const auto& own_bodies = job.request->own_bodies;
  bench.groups.clear();
  for (const scan::BodyGroup& group : sweep.groups) {
    const BodyId id = sweep.motions[group.first].body->id;
    if (!std::binary_search(own_bodies.begin(), own_bodies.end(), id)) bench.groups.push_back(group);
  }
  bench.body_hits.resize(beams);
  bench.building_hits.resize(beams);
  bench.caster.share_building(building);
  const double range_max = laser.convention.range_max;
  bench.caster.cast_groups(job.laser, set, sweep.motions, bench.groups, range_max, bench.body_hits);
  bench.caster.cast_building_before(bench.body_hits, job.laser, set, range_max, bench.building_hits);
  scan::simulate_scan(laser, job.key, bench.body_hits, bench.building_hits, job.stamp, scan);
}

}  // namespace

bool simulate_laser(const Configuration& configuration, const simulation::LaserRequest& request, State& state,
                    Scan& scan) {
  AgentScanPath& own = state.agent_laser;
  const auto job = job_of(configuration, request, state);
  if (!job) return false;
  cast(*job, own.sweeps[job->sweep], state.caster, own.benches.front(), scan);
  own.jobs.assign(1, *job);
  return true;
}

void answer_lasers(const Configuration& configuration, State& state, Outputs& outputs) {
  AgentScanPath& own = state.agent_laser;
  own.jobs.clear();
  for (const simulation::LaserRequest& request : state.laser_requests) {
    if (const auto job = job_of(configuration, request, state)) own.jobs.push_back(*job);
  }
  if (own.jobs.empty()) return;
  if (own.scans.size() < own.jobs.size()) own.scans.resize(own.jobs.size());
  state.executor->run(static_cast<int>(own.jobs.size()), [&](int i, int worker) {
    const auto at = static_cast<std::size_t>(i);
    cast(own.jobs[at], own.sweeps[own.jobs[at].sweep], state.caster,
         own.benches[static_cast<std::size_t>(worker)], own.scans[at]);
  });
  for (std::size_t i = 0; i < own.jobs.size(); ++i) {
    const std::string& agent = own.jobs[i].request->agent;
    state.simulation.give_scan(agent, own.scans[i]);
    encode(own.scans[i], outputs.add("MR_AGENT_" + agent + "_SCAN"));
  }
}

}  // namespace parhelion::tick

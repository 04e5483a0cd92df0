#include "server/tick/laser_path.hpp"

#include <algorithm>
#include <optional>

#include "protocols/codec.hpp"
#include "server/tick/bodies_in_sweep.hpp"

namespace parhelion::tick {
namespace {

/// The bodies that a laser with this sweep can hit; shared by lasers with the same sweep in a step. None: the
/// world is not known.
std::optional<std::size_t> find_sweep(SimulationTime start, SimulationTime end,
                                      const simulation::Simulation& simulation, LaserState& own) {
  if (own.swept != end) own.sweep_count = 0;
  own.swept = end;
  for (std::size_t i = 0; i < own.sweep_count; ++i) {
    if (own.sweeps[i].start == start) return i;
  }
  const auto holds = [](const WorldSnapshot& world, SimulationTime t) {
    return world.scene && world.stamp == t;
  };
  if (!holds(own.world_end, end) && !simulation.at(end, own.world_end)) return std::nullopt;
  if (!simulation.at(start, own.world_start)) own.world_start = own.world_end;
  if (own.sweeps.size() == own.sweep_count) own.sweeps.emplace_back();
  SweptWorld& sweep = own.sweeps[own.sweep_count];
  sweep.start = start;
  bodies_in_sweep(own.world_start, own.world_end, sweep.motions,
                  [](const BodyDefinition& body, const BodyState&) { return is_cast_as_body(body); });
  group_bodies(sweep.motions, sweep.groups);
  return own.sweep_count++;
}

/// The laser's poses at both ends of its sweep, from the motion of the body that carries it.
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

/// Creates the job of a request. Noise keys differ from real scans, whose sequence numbers stay below 2^32.
std::optional<LaserJob> job_of(const Configuration& configuration, const simulation::LaserRequest& request,
                               const simulation::Simulation& simulation, LaserState& own) {
  const scan::Sweep sweep = scan::beam_times(request.laser, static_cast<std::size_t>(request.laser.beams),
                                             own.scratch.front().beam_time);
  const auto swept = find_sweep(request.stamp - (sweep.end - sweep.start), request.stamp, simulation, own);
  if (!swept) return std::nullopt;
  return LaserJob{
      &request,
      *swept,
      laser_motion(request, own.sweeps[*swept]),
      {configuration.scenario.seed, (std::uint64_t{request.own_bodies.front()} + 1) << 32 | ++own.sequence},
      {request.stamp.ns - sweep.end.ns}};
}

void cast(const LaserJob& job, const SweptWorld& sweep, const scan::RayCaster& building,
          LaserScratch& scratch, Scan& scan) {
  const LaserDescription& laser = job.request->laser;
  const auto beams = static_cast<std::size_t>(laser.beams);
  scan::beam_times(laser, beams, scratch.beam_time);
  const scan::BeamSet set{static_cast<float>(laser.angle_min), static_cast<float>(laser.angle_increment),
                          scratch.beam_time};
  const auto& own_bodies = job.request->own_bodies;
  scratch.groups.clear();
  for (const scan::BodyGroup& group : sweep.groups) {
    const BodyId id = sweep.motions[group.first].body->id;
    if (!std::binary_search(own_bodies.begin(), own_bodies.end(), id)) scratch.groups.push_back(group);
  }
  scratch.body_hits.resize(beams);
  scratch.building_hits.resize(beams);
  scratch.caster.share_building(building);
  const double range_max = laser.convention.range_max;
  scratch.caster.cast_groups(job.laser, set, sweep.motions, scratch.groups, range_max, scratch.body_hits);
  scratch.caster.cast_nearer_building(scratch.body_hits, job.laser, set, range_max, scratch.building_hits);
  scan::simulate_scan(laser, job.key, scratch.body_hits, scratch.building_hits, job.stamp, scan);
}

}  // namespace

LaserState::LaserState(std::unique_ptr<Executor> executor_) : executor(std::move(executor_)) {
  scratch.resize(static_cast<std::size_t>(executor->size()));
}

bool simulate_laser(const Configuration& configuration, const simulation::LaserRequest& request,
                    const simulation::Simulation& simulation, const scan::RayCaster& building,
                    LaserState& lasers, Scan& scan) {
  const auto job = job_of(configuration, request, simulation, lasers);
  if (!job) return false;
  cast(*job, lasers.sweeps[job->sweep], building, lasers.scratch.front(), scan);
  lasers.jobs.assign(1, *job);
  return true;
}

void publish_agent_scans(const TickContext& context, const scan::RayCaster& building,
                         simulation::Simulation& simulation, LaserState& lasers) {
  lasers.jobs.clear();
  for (const simulation::LaserRequest& request : lasers.requests) {
    if (const auto job = job_of(context.configuration, request, simulation, lasers))
      lasers.jobs.push_back(*job);
  }
  if (lasers.jobs.empty()) return;
  if (lasers.scans.size() < lasers.jobs.size()) lasers.scans.resize(lasers.jobs.size());
  lasers.executor->run(static_cast<int>(lasers.jobs.size()), [&](int i, int worker) {
    const auto at = static_cast<std::size_t>(i);
    cast(lasers.jobs[at], lasers.sweeps[lasers.jobs[at].sweep], building,
         lasers.scratch[static_cast<std::size_t>(worker)], lasers.scans[at]);
  });
  for (std::size_t i = 0; i < lasers.jobs.size(); ++i) {
    const std::string& agent = lasers.jobs[i].request->agent;
    simulation.give_scan(agent, lasers.scans[i]);
    encode(lasers.scans[i], context.outputs.add("MR_AGENT_" + agent + "_SCAN"));
  }
}

}  // namespace parhelion::tick

// Simulated lasers: cast in the building and against all bodies but their own, as this type measures.
#include "server/bodies_in_sweep.hpp"
#include "server/tick.hpp"

namespace parhelion {
namespace {

/// Where the laser was at both ends of its sweep, by how the body that carries it moved.
LaserMotion laser_motion(const LaserRequest& request, const AgentScanPath& own) {
  LaserMotion laser{request.T_map_laser, request.T_map_laser};
  const BodyId carrier = request.own_bodies.front();
  const auto of_carrier = [carrier](const BodyState& body) { return body.id == carrier; };
  const auto now = std::find_if(own.world_end.bodies.begin(), own.world_end.bodies.end(), of_carrier);
  const auto before = std::find_if(own.world_start.bodies.begin(), own.world_start.bodies.end(), of_carrier);
  if (now == own.world_end.bodies.end() || before == own.world_start.bodies.end()) return laser;
  if (before->epoch == now->epoch)
    laser.T_map_laser_start = before->T_map_body * (now->T_map_body.inverse() * request.T_map_laser);
  return laser;
}

}  // namespace

bool simulate_laser(const Configuration& configuration, const LaserRequest& request, State& state) {
  AgentScanPath& own = state.agent_laser;
  const Sweep sweep = beam_times(request.laser, static_cast<std::size_t>(request.laser.beams), own.beam_time);
  const SimulationTime start = request.stamp - (sweep.end - sweep.start);
  // All lasers of a step share its world, and those of one kind its start.
  const auto holds = [](const WorldSnapshot& world, SimulationTime t) {
    return world.scene && world.stamp == t;
  };
  if (!holds(own.world_end, request.stamp) && !state.simulation.at(request.stamp, own.world_end))
    return false;
  if (!holds(own.world_start, start) && !state.simulation.at(start, own.world_start))
    own.world_start = own.world_end;
  bodies_in_sweep(
      own.world_start, own.world_end, own.motions, [&](const BodyDefinition& body, const BodyState&) {
        const bool is_own = std::binary_search(request.own_bodies.begin(), request.own_bodies.end(), body.id);
        return !is_own && is_cast_as_body(body);
      });
  const LaserMotion laser = laser_motion(request, own);
  const BeamSet beams{static_cast<float>(request.laser.angle_first),
                      static_cast<float>(request.laser.angle_step), own.beam_time};
  own.body_hits.resize(own.beam_time.size());
  own.building_hits.resize(own.beam_time.size());
  const double range_max = request.laser.convention.range_max;
  state.caster.cast_bodies(laser, beams, own.motions, range_max, own.body_hits);
  state.caster.cast_building(laser, beams, range_max, own.building_hits);
  // Keyed apart from the real scans, whose sequence numbers stay below 2^32.
  const NoiseKey key{configuration.scenario.seed,
                     (std::uint64_t{request.own_bodies.front()} + 1) << 32 | ++own.sequence};
  const SensorTime stamp{request.stamp.ns - sweep.end.ns};
  simulate_scan(request.laser, key, own.body_hits, own.building_hits, stamp, own.scan);
  return true;
}

void answer_laser(const Configuration& configuration, const LaserRequest& request, State& state,
                  Outputs& outputs) {
  if (!simulate_laser(configuration, request, state)) return;
  state.simulation.give_scan(request.agent, state.agent_laser.scan);
  encode(state.agent_laser.scan, outputs.add("MR_AGENT_" + request.agent + "_SCAN"));
}

}  // namespace parhelion

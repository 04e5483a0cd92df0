// Injects virtual returns into a real scan (promise 1): nothing real is hidden, untouched beams stay bit-identical.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/scan.hpp"
#include "protocols/world.hpp"

namespace parhelion {

/// A rigid body over a sweep: pose at the sweep's start and end; between them position linear, rotation slerp.
struct BodyMotion {
  const BodyDefinition* body = nullptr;
  Transform<Map, Body> T_map_body_start;
  Transform<Map, Body> T_map_body_end;
};

/// The laser over a sweep, the same way.
struct LaserMotion {
  Transform<Map, Laser> T_map_laser_start;
  Transform<Map, Laser> T_map_laser_end;
};

/// Which beams to cast: angles from the scan, instants from the description, both over the sweep [0, 1].
struct BeamSet {
  float angle_first = 0, angle_step = 0;  ///< rad
  std::span<const float> time;            ///< per beam: 0 at the sweep's start, 1 at its end
};

/// Exact range of the nearest surface along each beam, and whose.
struct RangeHit {
  float range = 0;       ///< m; +inf: nothing within max_range
  std::int32_t body = -1;  ///< index into the bodies given, -1: none; the building counts as none
  float reflectivity = 0;
};

/// Casts beams against moving bodies (and, where asked, the building). Not thread-safe; one per thread. After warm-up our
/// own code allocates nothing.
class RayCaster {
 public:
  RayCaster();
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// The static building, from the semantic model (all entities that are not is_virtual).
  void set_building(const SemanticModel& model);
  /// hits.size() == beams.time.size(). The origin's own body is left out by not being in `bodies`.
  void cast_bodies(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies, double max_range,
                   std::span<RangeHit> hits);
  void cast_building(const LaserMotion& laser, const BeamSet& beams, double max_range, std::span<RangeHit> hits);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The slow exact twin: every shape against every beam analytically, double precision, no acceleration structure.
void cast_bodies_exact(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                       double max_range, std::span<RangeHit> hits);
void cast_building_exact(const LaserMotion& laser, const BeamSet& beams, const SemanticModel& model, double max_range,
                         std::span<RangeHit> hits);

/// Key of the noise of one beam: the same for any thread count and order.
struct NoiseKey {
  std::uint64_t seed = 0;
  std::uint64_t scan_sequence = 0;
};

/// Range as the sensor would write it: noise by (key, beam), quantised, sentinel where too close or out of range.
float measure_range(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range);

/// Promise 1. Writes the scan with virtual returns to `out` (same beams, stamp and angles as `real`) and the body index of
/// each replaced beam to `beam_body` (-1: not replaced). `virtual_hits` from cast_bodies over injectable bodies only,
/// `building_hits` from cast_building (a no-return beam is replaced only where nearer than both it and range_max).
/// Returns the number of replaced beams.
std::size_t augment_scan(const Scan& real, const LaserDescription& laser, NoiseKey key,
                         std::span<const RangeHit> virtual_hits, std::span<const RangeHit> building_hits, Scan& out,
                         std::vector<std::int32_t>& beam_body);

/// A whole simulated scan (levels 1 and 2, agents' own lasers): nearest of bodies and building, through measure_range.
void simulate_scan(const LaserDescription& laser, NoiseKey key, std::span<const RangeHit> body_hits,
                   std::span<const RangeHit> building_hits, SensorTime stamp, Scan& out);

/// Fills `time` with each beam's instant over the sweep, and returns the sweep's first and last instant relative to the
/// scan's stamp.
struct Sweep {
  Duration start, end;
};
Sweep beam_times(const LaserDescription& laser, std::size_t beams, std::vector<float>& time);

}  // namespace parhelion

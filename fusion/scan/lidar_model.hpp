// Model of a planar laser: converts a true range to a measured value, and gives the time of each beam.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/scan/ray_caster.hpp"
#include "protocols/scan.hpp"

namespace parhelion::scan {

/// Key of the noise of one beam: independent of thread count and order.
struct NoiseKey {
  std::uint64_t seed = 0;
  std::uint64_t scan_sequence = 0;
};

/// The measurement of a true range: its kind and the float that the sensor reports.
struct Measurement {
  BeamKind kind = BeamKind::no_return;
  float range = 0;  ///< m, or the sentinel of `kind` in the sensor's own convention
};

/// Adds noise by (key, beam), then quantises, then applies the limits. A true range below range_min is too
/// close whatever the noise; a hit is never written as a sentinel value of the convention (it moves one step
/// nearer). NaN: invalid.
Measurement measure(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range);

/// The range as the sensor reports it: measure().range.
float measure_range(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range);

/// A sample of the standard normal distribution that depends only on (key, beam): Philox4x32-10 (Salmon et
/// al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011) through the quantile function (Wichura, AS
/// 241, 1988).
double standard_normal(NoiseKey key, std::size_t beam);

/// First and last instant of a sweep, relative to the scan's stamp.
struct Sweep {
  Duration start, end;
};

/// Fills `time` with each beam's normalized time in the sweep: 0 at its start, 1 at its end (all 0 where it
/// takes no time).
Sweep beam_times(const LaserDescription& laser, std::size_t beams, std::vector<float>& time);
/// The same for the beams of a scan, by its own times where it has them.
Sweep beam_times(const LaserDescription& laser, const Scan& scan, std::vector<float>& time);

/// The beams of a scan, one for each of `time`, at most as many as it has. Valid while both live.
BeamSet beam_set(const Scan& scan, std::span<const float> time);

}  // namespace parhelion::scan

// How a planar laser turns a true distance into a number on the wire, and when it measures each beam.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocols/scan.hpp"

namespace parhelion::scan {

/// Key of the noise of one beam: the same for any thread count and order.
struct NoiseKey {
  std::uint64_t seed = 0;
  std::uint64_t scan_sequence = 0;
};

/// What the sensor makes of a true range: the kind, and the float that it writes for it.
struct Measurement {
  BeamKind kind = BeamKind::no_return;
  float range = 0;  ///< m, or the sentinel of `kind` in the sensor's own convention
};

/// Noise by (key, beam), then quantisation, then the limits. A true range below range_min is too close
/// whatever the noise; a hit is never written as a number that the convention reads as a sentinel (it moves
/// one step nearer). NaN: invalid.
Measurement measure(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range);

/// Range as the sensor would write it: measure().range.
float measure_range(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range);

/// A draw from the standard normal distribution that depends on (key, beam) alone: Philox4x32-10 (Salmon et
/// al., "Parallel random numbers: as easy as 1, 2, 3", SC 2011) through the quantile function (Wichura, AS
/// 241, 1988).
double standard_normal(NoiseKey key, std::size_t beam);

/// First and last instant of a sweep, relative to the scan's stamp.
struct Sweep {
  Duration start, end;
};

/// Fills `time` with each beam's instant over the sweep: 0 at its start, 1 at its end (all 0 where it takes
/// no time).
Sweep beam_times(const LaserDescription& laser, std::size_t beams, std::vector<float>& time);

}  // namespace parhelion::scan

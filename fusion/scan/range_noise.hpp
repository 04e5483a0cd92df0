// The noise of a laser, as its data sheet gives it or as learned from its returns (RangeNoise).
#pragma once

#include <cstddef>

#include "fusion/scan/lidar_model.hpp"
#include "protocols/scan.hpp"

namespace parhelion::scan {

/// m, median 1 sigma at a range (m), linear between the ranges of RangeNoise::sigma and constant beyond.
double sigma_at(const RangeNoise& noise, double range);

/// The index of the range of RangeNoise::sigma that is nearest to `range` (m) by its logarithm.
std::size_t range_bin(double range);

/// m, to add to a true range before it is quantised. `tan_incidence`: tangent of the angle between the beam
/// and the normal of the surface. A function of (key, beam) only, so it does not depend on the order of
/// beams: correlation is a moving average over neighbours' samples.
double sample_noise(const LaserDescription& laser, NoiseKey key, std::size_t beam, double range,
                    double tan_incidence);

/// measure() on a surface whose angle of incidence is known.
Measurement measure_surface(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range,
                            double tan_incidence);

/// One of the laser's intensity codes (not empty) by their fractions; neighbours mostly have the same.
float sample_intensity(const LaserDescription& laser, NoiseKey key, std::size_t beam);

}  // namespace parhelion::scan

// Injects virtual returns into a real scan (promise 1): nothing real is hidden, untouched beams stay
// bit-identical.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/scan/lidar_model.hpp"
#include "fusion/scan/ray_caster.hpp"
#include "protocols/scan.hpp"

namespace parhelion::scan {

/// Promise 1. Writes the scan with virtual returns to `out` (same beams, stamp and angles as `real`) and the
/// body index of each replaced beam to `beam_body` (-1: not replaced). `virtual_hits` from cast_bodies over
/// injectable bodies only, `building_hits` from cast_building (a no-return beam is replaced only where the
/// virtual hit is nearer than both it and range_max). Where a span is shorter than the scan, the remaining
/// beams are unknown and not replaced. Where the scan has intensities, a replaced beam gets the material's
/// reflectivity times LaserDescription::intensity_scale. Returns the number of replaced beams.
std::size_t augment_scan(const Scan& real, const LaserDescription& laser, NoiseKey key,
                         std::span<const RangeHit> virtual_hits, std::span<const RangeHit> building_hits,
                         Scan& out, std::vector<std::int32_t>& beam_body);

/// A fully simulated scan (levels 1 and 2, agents' own lasers): the nearest of bodies and building, through
/// measure(). One beam per body hit, angles of the description. Where the description has intensities, each
/// is the reflectivity of the surface times intensity_scale, 0 without a return.
void simulate_scan(const LaserDescription& laser, NoiseKey key, std::span<const RangeHit> body_hits,
                   std::span<const RangeHit> building_hits, SensorTime stamp, Scan& out);

}  // namespace parhelion::scan

#pragma once

#include <cmath>

#include "fusion/scan/ray_caster.hpp"

namespace parhelion::test {

/// Ranges within 1 mm, or neither hits.
inline bool hits_agree(const scan::RangeHit& a, const scan::RangeHit& b) {
  if (std::isinf(a.range) || std::isinf(b.range)) return a.range == b.range;
  return std::abs(a.range - b.range) <= 1e-3F;
}

}  // namespace parhelion::test

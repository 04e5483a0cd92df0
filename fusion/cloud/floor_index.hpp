// The index of a cell along one axis.
#pragma once

#include <cassert>
#include <cmath>

namespace parhelion::cloud {

/// floor(v) for |v| < 2^31. std::floor has to work for larger values too, which costs more than all the rest
/// of a cell's index where the processor's own instruction for it may not be used.
inline int floor_index(double v) {
  assert(std::abs(v) < 0x1p31);
  const int towards_zero = static_cast<int>(v);
  return towards_zero - (v < towards_zero ? 1 : 0);
}

}  // namespace parhelion::cloud

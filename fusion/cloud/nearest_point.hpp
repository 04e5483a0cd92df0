// The nearest point of a contiguous range: with AVX2 where the processor has it, else by the portable
// reference implementation. Both give identical bits, as both round each product and sum separately.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>

namespace parhelion::cloud {

struct NearestPoint {
  std::int32_t index = -1;                                 ///< the lowest among equally near ones
  float d2 = std::numeric_limits<float>::infinity();       ///< m^2
  float second2 = std::numeric_limits<float>::infinity();  ///< m^2, of the second nearest

  void offer(std::int32_t i, float distance2) {
    if (distance2 < d2 || (distance2 == d2 && i < index)) {
      second2 = d2;
      d2 = distance2;
      index = i;
    } else if (distance2 < second2) {
      second2 = distance2;
    }
  }
};

/// m^2, rounded as in all searches.
inline float distance2(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const float dx = a.x() - b.x(), dy = a.y() - b.y(), dz = a.z() - b.z();
  return (dx * dx + dy * dy) + dz * dz;
}

struct PointColumns {
  const float *x, *y, *z;  ///< readable up to 8 elements beyond the end of a range
};

/// Updates `found` with each point of [begin, end).
void nearest_point_portable(const PointColumns& points, std::uint32_t begin, std::uint32_t end,
                            const Eigen::Vector3f& p, NearestPoint& found);
void nearest_point_avx2(const PointColumns& points, std::uint32_t begin, std::uint32_t end,
                        const Eigen::Vector3f& p, NearestPoint& found);
bool have_avx2();

}  // namespace parhelion::cloud

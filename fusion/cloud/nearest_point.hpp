// The nearest of a run of points to one: by AVX2 where the processor has it, and by its portable twin, which
// gives the same answer to the bit (both round each product and sum by itself).
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

/// m^2, rounded as all searches round it.
inline float distance2(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  const float dx = a.x() - b.x(), dy = a.y() - b.y(), dz = a.z() - b.z();
  return (dx * dx + dy * dy) + dz * dz;
}

struct PointColumns {
  const float *x, *y, *z;  ///< readable up to 8 beyond a run's end
};

/// Offers `found` each of [begin, end).
void nearest_point_portable(const PointColumns& points, std::uint32_t begin, std::uint32_t end,
                            const Eigen::Vector3f& p, NearestPoint& found);
void nearest_point_avx2(const PointColumns& points, std::uint32_t begin, std::uint32_t end,
                        const Eigen::Vector3f& p, NearestPoint& found);
bool have_avx2();

}  // namespace parhelion::cloud

#include "fusion/cloud/nearest_point.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace parhelion::cloud {

void nearest_point_portable(const PointColumns& points, std::uint32_t begin, std::uint32_t end,
                            const Eigen::Vector3f& p, NearestPoint& found) {
  for (std::uint32_t i = begin; i < end; ++i) {
    const float dx = points.x[i] - p.x(), dy = points.y[i] - p.y(), dz = points.z[i] - p.z();
    found.offer(static_cast<std::int32_t>(i), (dx * dx + dy * dy) + dz * dz);
  }
}

#if defined(__x86_64__)

bool have_avx2() {
  static const bool have = __builtin_cpu_supports("avx2");
  return have;
}

__attribute__((target("avx2"))) void nearest_point_avx2(const PointColumns& points, std::uint32_t begin,
                                                        std::uint32_t end, const Eigen::Vector3f& p,
                                                        NearestPoint& found) {
  const __m256 px = _mm256_set1_ps(p.x()), py = _mm256_set1_ps(p.y()), pz = _mm256_set1_ps(p.z());
  const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  for (std::uint32_t i = begin; i < end; i += 8) {
    const __m256 dx = _mm256_sub_ps(_mm256_loadu_ps(points.x + i), px);
    const __m256 dy = _mm256_sub_ps(_mm256_loadu_ps(points.y + i), py);
    const __m256 dz = _mm256_sub_ps(_mm256_loadu_ps(points.z + i), pz);
    const __m256 d2 =
        _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(dx, dx), _mm256_mul_ps(dy, dy)), _mm256_mul_ps(dz, dz));
    const __m256i within = _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int>(end - i)), lanes);
    // Only points nearer than the second nearest matter; usually there are none.
    const __m256 near = _mm256_and_ps(_mm256_cmp_ps(d2, _mm256_set1_ps(found.second2), _CMP_LE_OQ),
                                      _mm256_castsi256_ps(within));
    auto hits = static_cast<unsigned>(_mm256_movemask_ps(near));
    if (hits == 0) continue;
    alignas(32) float values[8];
    _mm256_store_ps(values, d2);
    for (; hits != 0; hits &= hits - 1) {
      const int lane = __builtin_ctz(hits);
      found.offer(static_cast<std::int32_t>(i) + lane, values[lane]);
    }
  }
}

#else

bool have_avx2() { return false; }
void nearest_point_avx2(const PointColumns& points, std::uint32_t begin, std::uint32_t end,
                        const Eigen::Vector3f& p, NearestPoint& found) {
  nearest_point_portable(points, begin, end, p, found);
}

#endif

}  // namespace parhelion::cloud

#include "fusion/cloud/point_tree.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "fusion/cloud/parallel.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace parhelion::cloud {
namespace {

constexpr float kFarAway = 1e18f;  // its square is finite
constexpr std::size_t kLanes = PointTree::kLanes;

struct Entry {
  Eigen::Vector3f p;
  std::uint32_t index;
};

void halve(std::span<Entry> entries, std::size_t leaf, int threads) {
  const std::size_t leaves = (entries.size() + leaf - 1) / leaf;
  if (leaves < 2) return;
  Eigen::AlignedBox3f box;
  for (const Entry& entry : entries) box.extend(entry.p);
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  // A power of two in the first part, so that eight consecutive leaves always form one subtree.
  const std::size_t middle = std::bit_ceil(leaves) / 2 * leaf;
  std::nth_element(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(middle), entries.end(),
                   [axis](const Entry& a, const Entry& b) { return a.p[axis] < b.p[axis]; });
  constexpr std::size_t worth_a_thread = 20000;
  const int inner = entries.size() > worth_a_thread ? threads : 1;
  run_both(
      inner, [&] { halve(entries.first(middle), leaf, inner); },
      [&] { halve(entries.subspan(middle), leaf, inner); });
}

float beyond(float low, float high, float p_low, float p_high) {
  return std::max(std::max(low - p_high, p_low - high), 0.0f);
}

}  // namespace

std::vector<std::uint32_t> tree_order(std::span<const Eigen::Vector3f> points, std::size_t leaf,
                                      int threads) {
  std::vector<Entry> entries(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) entries[i] = {points[i], static_cast<std::uint32_t>(i)};
  with_threads(threads, [&] { halve(entries, leaf, threads); });
  std::vector<std::uint32_t> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) order[i] = entries[i].index;
  return order;
}

PointTree::PointTree(std::span<const Eigen::Vector3f> points, int threads, bool portable)
    : avx2_(have_avx2() && !portable), order_(tree_order(points, kLanes, threads)) {
  assert(!points.empty());
  for (auto* column : {&x_, &y_, &z_})
    column->assign((points.size() + kLanes - 1) / kLanes * kLanes, kFarAway);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Eigen::Vector3f& p = points[order_[i]];
    x_[i] = p.x(), y_[i] = p.y(), z_[i] = p.z();
  }
  make_boxes();
}

void PointTree::make_boxes() {
  std::vector<Eigen::AlignedBox3f> boxes(x_.size() / kLanes);
  for (std::size_t i = 0; i < order_.size(); ++i) boxes[i / kLanes].extend(point(i));
  while (levels_.empty() || levels_.back().size() > 1) {
    std::vector<Boxes>& level = levels_.emplace_back((boxes.size() + kLanes - 1) / kLanes);
    std::vector<Eigen::AlignedBox3f> above(level.size());
    const Eigen::AlignedBox3f nowhere(Eigen::Vector3f::Constant(kFarAway));
    for (std::size_t i = 0; i < level.size() * kLanes; ++i) {
      const Eigen::AlignedBox3f& box = i < boxes.size() ? boxes[i] : nowhere;
      for (int axis = 0; axis < 3; ++axis) {
        level[i / kLanes].side[axis][i % kLanes] = box.min()[axis];
        level[i / kLanes].side[axis + 3][i % kLanes] = box.max()[axis];
      }
      if (i < boxes.size()) above[i / kLanes].extend(box);
    }
    boxes = std::move(above);
  }
}

void PointTree::leaves_near(const Eigen::AlignedBox3f& box, float distance, Leaves& near) const {
  struct Open {
    std::uint32_t level, boxes;
  };
  std::array<Open, 16 * kLanes> stack;  // more levels than 32 bits have octets
  std::size_t open = 0;
  near.count = 0;
  stack[open++] = {static_cast<std::uint32_t>(levels_.size() - 1), 0};
  while (open > 0) {
    const Open at = stack[--open];
    const std::uint32_t first = at.boxes * kLanes;
    unsigned mask = hits(levels_[at.level][at.boxes], box, distance);
    if (at.level == 0) {
      add_leaves(at.boxes, mask, near);
      continue;
    }
    // The last is pushed first, so that the first is processed next.
    while (mask != 0) {
      const auto last = static_cast<std::uint32_t>(31 - std::countl_zero(mask));
      stack[open++] = {at.level - 1, first + last};
      mask &= ~(1u << last);
    }
  }
}

void PointTree::add_leaves(std::uint32_t eight, unsigned mask, Leaves& near) const {
  if (near.first.size() < near.count + 2 * kLanes) {
    near.first.resize(2 * near.count + 8 * kLanes);
    near.boxes.resize(near.first.size() / kLanes);
  }
  const Boxes& from = levels_[0][eight];
  for (; mask != 0; mask &= mask - 1) {
    const auto lane = static_cast<unsigned>(std::countr_zero(mask));
    Boxes& to = near.boxes[near.count / kLanes];
    for (int side = 0; side < 6; ++side) to.side[side][near.count % kLanes] = from.side[side][lane];
    near.first[near.count++] = static_cast<std::uint32_t>((eight * kLanes + lane) * kLanes);
  }
  if (near.count % kLanes == 0) return;
  for (auto& side : near.boxes[near.count / kLanes].side) {
    for (std::size_t i = near.count % kLanes; i < kLanes; ++i) side[i] = kFarAway;
  }
}

std::uint32_t PointTree::about_nearest(const Eigen::Vector3f& p) const {
  std::size_t at = 0;
  for (std::size_t level = levels_.size(); level-- > 0;) {
    const Boxes& boxes = levels_[level][at];
    std::size_t nearest = 0;
    float nearest2 = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < kLanes; ++i) {
      const float dx = beyond(boxes.side[0][i], boxes.side[3][i], p.x(), p.x()),
                  dy = beyond(boxes.side[1][i], boxes.side[4][i], p.y(), p.y()),
                  dz = beyond(boxes.side[2][i], boxes.side[5][i], p.z(), p.z());
      const float d2 = (dx * dx + dy * dy) + dz * dz;
      if (d2 < nearest2) nearest2 = d2, nearest = i;
    }
    at = at * kLanes + nearest;
  }
  NearestPoint found;
  const auto begin = static_cast<std::uint32_t>(at * kLanes);
  nearest_point_portable({x_.data(), y_.data(), z_.data()}, begin, begin + kLanes, p, found);
  return static_cast<std::uint32_t>(found.index);
}

void PointTree::nearest(const Leaves& near, std::span<Query> queries) const {
  if (avx2_) {
    nearest_avx2(near, queries);
  } else {
    for (Query& query : queries) nearest_portable(near, query);
  }
  for (Query& query : queries) {
    if (query.found.d2 > query.distance2) query.found.index = -1;
    query.found.second2 = std::min(query.found.second2, query.distance2);
  }
}

void PointTree::nearest_portable(const Leaves& near, Query& query) const {
  query.found = {};
  const Eigen::AlignedBox3f box(query.p, query.p);
  for (std::size_t i = 0; i < near.count; i += kLanes) {
    for (unsigned mask = hits(near.boxes[i / kLanes], box, query.distance2); mask != 0; mask &= mask - 1) {
      const std::uint32_t begin = near.first[i + static_cast<unsigned>(std::countr_zero(mask))];
      nearest_point_portable({x_.data(), y_.data(), z_.data()}, begin, begin + kLanes, query.p, query.found);
    }
    if (!query.second) query.distance2 = std::min(query.distance2, query.found.d2);
  }
}

#if defined(__x86_64__)

namespace {

__attribute__((target("avx2"))) inline __m256 squares8(__m256 x, __m256 y, __m256 z) {
  return _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(x, x), _mm256_mul_ps(y, y)), _mm256_mul_ps(z, z));
}

__attribute__((target("avx2"))) inline __m256 beyond8(const float* low, const float* high, __m256 p_low,
                                                      __m256 p_high) {
  const __m256 d =
      _mm256_max_ps(_mm256_sub_ps(_mm256_load_ps(low), p_high), _mm256_sub_ps(p_low, _mm256_load_ps(high)));
  return _mm256_max_ps(d, _mm256_setzero_ps());
}

__attribute__((target("avx2"))) inline __m256 distances8(const float (*side)[kLanes], const __m256* low,
                                                         const __m256* high) {
  return squares8(beyond8(side[0], side[3], low[0], high[0]), beyond8(side[1], side[4], low[1], high[1]),
                  beyond8(side[2], side[5], low[2], high[2]));
}

__attribute__((target("avx2"))) unsigned hits_avx2(const float (*side)[kLanes],
                                                   const Eigen::AlignedBox3f& box, float distance2) {
  __m256 low[3], high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] = _mm256_set1_ps(box.min()[axis]);
    high[axis] = _mm256_set1_ps(box.max()[axis]);
  }
  const __m256 hit = _mm256_cmp_ps(distances8(side, low, high), _mm256_set1_ps(distance2), _CMP_LE_OQ);
  return static_cast<unsigned>(_mm256_movemask_ps(hit));
}

__attribute__((target("avx2"))) inline float least8(__m256 v) {
  __m128 m = _mm_min_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps(v, 1));
  m = _mm_min_ps(m, _mm_movehl_ps(m, m));
  return _mm_cvtss_f32(_mm_min_ss(m, _mm_shuffle_ps(m, m, 1)));
}

/// The nearest and second nearest of each lane.
struct Lanes {
  __m256 best, second;
  __m256i index;
};

__attribute__((target("avx2"))) inline void look8(Lanes& lanes8, __m256 d2, std::size_t begin) {
  const __m256i here =
      _mm256_add_epi32(_mm256_set1_epi32(static_cast<int>(begin)), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
  const __m256 nearer = _mm256_cmp_ps(d2, lanes8.best, _CMP_LT_OQ);
  lanes8.second = _mm256_min_ps(lanes8.second, _mm256_max_ps(lanes8.best, d2));
  lanes8.best = _mm256_min_ps(lanes8.best, d2);
  lanes8.index = _mm256_blendv_epi8(lanes8.index, here, _mm256_castps_si256(nearer));
}

__attribute__((target("avx2"))) inline NearestPoint of_lanes(const Lanes& lanes8) {
  NearestPoint found;
  found.d2 = least8(lanes8.best);
  const __m256 is_best = _mm256_cmp_ps(lanes8.best, _mm256_set1_ps(found.d2), _CMP_EQ_OQ);
  auto ties = static_cast<unsigned>(_mm256_movemask_ps(is_best));
  alignas(32) std::int32_t indices[kLanes];
  _mm256_store_si256(reinterpret_cast<__m256i*>(indices), lanes8.index);
  found.index = indices[__builtin_ctz(ties)];
  if ((ties & (ties - 1)) == 0) {
    found.second2 =
        least8(_mm256_min_ps(lanes8.second, _mm256_blendv_ps(lanes8.best, lanes8.second, is_best)));
    return found;
  }
  found.second2 = found.d2;
  for (; ties != 0; ties &= ties - 1) found.index = std::min(found.index, indices[__builtin_ctz(ties)]);
  return found;
}

}  // namespace

__attribute__((target("avx2"))) void PointTree::nearest_avx2(const Leaves& near,
                                                             std::span<Query> queries) const {
  for (Query& query : queries) {
    const __m256 at[3] = {_mm256_set1_ps(query.p.x()), _mm256_set1_ps(query.p.y()),
                          _mm256_set1_ps(query.p.z())};
    const __m256 none = _mm256_set1_ps(std::numeric_limits<float>::infinity());
    __m256 max_distance2 = _mm256_set1_ps(query.distance2);
    Lanes found{none, none, _mm256_set1_epi32(-1)};
    for (std::size_t i = 0; i < near.count; i += kLanes) {
      const __m256 hit =
          _mm256_cmp_ps(distances8(near.boxes[i / kLanes].side, at, at), max_distance2, _CMP_LE_OQ);
      auto mask = static_cast<unsigned>(_mm256_movemask_ps(hit));
      if (mask == 0) continue;
      for (; mask != 0; mask &= mask - 1) {
        const std::size_t begin = near.first[i + static_cast<unsigned>(__builtin_ctz(mask))];
        look8(found,
              squares8(_mm256_sub_ps(_mm256_loadu_ps(&x_[begin]), at[0]),
                       _mm256_sub_ps(_mm256_loadu_ps(&y_[begin]), at[1]),
                       _mm256_sub_ps(_mm256_loadu_ps(&z_[begin]), at[2])),
              begin);
      }
      if (query.second) continue;
      query.distance2 = std::min(query.distance2, least8(found.best));
      max_distance2 = _mm256_set1_ps(query.distance2);
    }
    query.found = of_lanes(found);
  }
}

#else

void PointTree::nearest_avx2(const Leaves& near, std::span<Query> queries) const {
  for (Query& query : queries) nearest_portable(near, query);
}

#endif

unsigned PointTree::hits(const Boxes& boxes, const Eigen::AlignedBox3f& box, float distance) const {
#if defined(__x86_64__)
  if (avx2_) return hits_avx2(boxes.side, box, distance);
#endif
  unsigned mask = 0;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float dx = beyond(boxes.side[0][i], boxes.side[3][i], box.min().x(), box.max().x()),
                dy = beyond(boxes.side[1][i], boxes.side[4][i], box.min().y(), box.max().y()),
                dz = beyond(boxes.side[2][i], boxes.side[5][i], box.min().z(), box.max().z());
    mask |= static_cast<unsigned>((dx * dx + dy * dy) + dz * dz <= distance) << i;
  }
  return mask;
}

}  // namespace parhelion::cloud

#include "fusion/semantic/objects/object_grid.hpp"

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace parhelion::semantic {
namespace {

constexpr double kOnFloor = 0.15;  ///< m: a point so little under a floor's top stands on it
constexpr double kBeside = 0.3;    ///< m: how far beyond its box a floor reaches

/// Tops of floors by plan cell of 2 m.
class FloorTops {
 public:
  explicit FloorTops(const std::vector<ModelEntity>& entities) {
    for (const ModelEntity& e : entities) {
      if (e.label != EntityLabel::floor || e.deleted) continue;
      const Eigen::Vector3d p = e.T_map_body.translation();
      const Eigen::Vector2d half = 0.5 * e.size.head<2>().array() + kBeside;
      const Top top{p.z() + e.size.z() / 2, p.head<2>() - half, p.head<2>() + half};
      lowest_ = std::min(lowest_, top.z);
      for (int y = cell(top.low.y()); y <= cell(top.high.y()); ++y) {
        for (int x = cell(top.low.x()); x <= cell(top.high.x()); ++x) by_cell_[{x, y}].push_back(top);
      }
    }
  }
  /// The highest floor under a point; the site's lowest where there is none.
  double under(const Eigen::Vector2d& p, double z) const {
    double best = std::numeric_limits<double>::lowest();
    if (const auto found = by_cell_.find({cell(p.x()), cell(p.y())}); found != by_cell_.end()) {
      for (const Top& top : found->second) {
        const bool inside = (p.array() >= top.low.array()).all() && (p.array() <= top.high.array()).all();
        if (inside && top.z < z + kOnFloor) best = std::max(best, top.z);
      }
    }
    return best > std::numeric_limits<double>::lowest() ? best : lowest_;
  }
  bool any() const { return !by_cell_.empty(); }

 private:
  struct Top {
    double z;
    Eigen::Vector2d low, high;
  };
  static int cell(double v) { return static_cast<int>(std::floor(v / 2)); }
  std::map<std::pair<int, int>, std::vector<Top>> by_cell_;
  double lowest_ = std::numeric_limits<double>::max();
};

}  // namespace

ObjectGrid::ObjectGrid(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                       const std::vector<ModelEntity>& entities, double cell)
    : cell_(cell) {
  std::vector<std::pair<Eigen::Vector3i, std::uint32_t>> all;
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    if (labels[i] != static_cast<std::uint8_t>(EntityLabel::unknown)) continue;
    const Eigen::Vector3d at = (cloud.points[i].cast<double>() / cell).array().floor();
    if (at.cwiseAbs().maxCoeff() < kFar) all.emplace_back(at.cast<int>(), i);
  }
  tbb::parallel_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.first.y(), a.first.x(), a.first.z(), a.second) <
           std::tuple(b.first.y(), b.first.x(), b.first.z(), b.second);
  });
  points_.reserve(all.size());
  for (const auto& [at, i] : all) {
    if (cubes_.empty() || cubes_.back().at != at) {
      const auto next = static_cast<std::uint32_t>(points_.size());
      cubes_.push_back({at, next, next, 0});
    }
    points_.push_back(i);
    ++cubes_.back().end;
    cubes_.back().z += cloud.points[i].z();
  }
  for (std::uint32_t c = 0; c < cubes_.size(); ++c) {
    ObjectCube& cube = cubes_[c];
    cube.z /= static_cast<float>(cube.end - cube.begin);
    const auto [column, is_new] = columns_.try_emplace(key_of(cube.at.x(), cube.at.y()), c, c);
    column->second.second = c + 1;
  }
  find_floors(entities);
}

void ObjectGrid::find_floors(const std::vector<ModelEntity>& entities) {
  const FloorTops tops(entities);
  std::vector<float> heights;
  for (const ObjectCube& cube : cubes_) heights.push_back(cube.z);
  double lowest = 0;
  if (!heights.empty()) {
    const auto at = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 100);
    std::nth_element(heights.begin(), at, heights.end());
    lowest = static_cast<double>(*at);
  }
  for (std::uint32_t c = 0; c < cubes_.size(); ++c)
    floor_.push_back(tops.any() ? tops.under(plan(c), static_cast<double>(cubes_[c].z)) : lowest);
}

std::pair<std::uint32_t, std::uint32_t> ObjectGrid::column(int x, int y) const {
  const auto found = columns_.find(key_of(x, y));
  return found == columns_.end() ? std::pair{0U, 0U} : found->second;
}

std::uint32_t ObjectGrid::find(const Eigen::Vector3i& at) const {
  const auto [first, last] = column(at.x(), at.y());
  for (std::uint32_t c = first; c < last; ++c) {
    if (cubes_[c].at.z() == at.z()) return c;
  }
  return kNone;
}

}  // namespace parhelion::semantic

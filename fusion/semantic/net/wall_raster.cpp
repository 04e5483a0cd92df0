#include "fusion/semantic/net/wall_raster.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/net/wall_batches.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr std::size_t kRays = 60'000;  ///< maximum for one wall, of few views
constexpr std::size_t kRaysOfView = 20'000;
constexpr std::size_t kMaxRays = 200'000;  ///< maximum for any number of views
constexpr double kSight = 40;              ///< m, from a wall to the scanners considered
constexpr double kBeyond = 0.5;            ///< m, a ray that ends this far behind a plane went through it
constexpr double kRecessMost = 0.40;       ///< m, maximum recess of a door
constexpr double kFront = 0.80;            ///< m, maximum depth of furniture in front of a wall
constexpr double kFaceFrom = 0.15;         ///< m over the raster's foot: height range of a door's leaf
constexpr double kFaceTo = 1.8;
constexpr std::size_t kFacePoints = 8;
constexpr std::size_t kChunk = 8192;  ///< points, of the work of one thread

void count(std::vector<std::uint16_t>& cells, std::size_t i) {
  if (cells[i] < std::numeric_limits<std::uint16_t>::max()) ++cells[i];
}

}  // namespace

PlanPoints::PlanPoints(const cloud::PointCloud<Map>& cloud, std::size_t enough) {
  for (const Eigen::Vector3d& v : cloud.viewpoints) viewpoints_.push_back(v.cast<float>());
  const std::size_t max_points = std::max(enough, cloud.size() / 4);
  const std::size_t stride = std::max<std::size_t>(1, (cloud.size() + max_points - 1) / max_points);
  Eigen::AlignedBox2f bounds;
  for (const Eigen::Vector3f& p : cloud.points) bounds.extend(p.head<2>());
  if (cloud.empty()) return;
  low_ = bounds.min().cast<double>();
  cells_ = cell_of(bounds.max().cast<double>()).array() + 1;
  std::vector<std::uint32_t> cell((cloud.size() + stride - 1) / stride);  // of each point kept
  cloud::for_each_chunk(cell.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Eigen::Vector2i c = cell_of(cloud.points[k * stride].head<2>().cast<double>());
      cell[k] = static_cast<std::uint32_t>(c.y()) * static_cast<std::uint32_t>(cells_.x()) +
                static_cast<std::uint32_t>(c.x());
    }
  });
  start_.assign(static_cast<std::size_t>(cells_.x()) * static_cast<std::size_t>(cells_.y()) + 1, 0);
  for (const std::uint32_t c : cell) ++start_[c + std::size_t{1}];
  for (std::size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
  points_.resize(start_.back());
  std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
  for (std::size_t k = 0; k < cell.size(); ++k) {
    const std::size_t i = k * stride, scan = cloud.scans.empty() ? 0 : cloud.scans[i];
    points_[next[cell[k]]++] = {cloud.points[i],
                                scan < viewpoints_.size() ? static_cast<std::int32_t>(scan) : -1};
  }
  any_unplaced_ = std::any_of(points_.begin(), points_.end(), [](const Point& p) { return p.viewpoint < 0; });
  sort_by_direction();
}

std::size_t PlanPoints::direction_of(const Point& point) const {
  const Eigen::Vector2f to_point =
      (point.p - viewpoints_[static_cast<std::size_t>(point.viewpoint)]).head<2>();
  const double turns = std::atan2(to_point.y(), to_point.x()) / (2 * EIGEN_PI) + 0.5;
  return std::min(static_cast<std::size_t>(turns * kDirections), kDirections - 1);
}

void PlanPoints::sort_by_direction() {
  if (viewpoints_.empty()) return;
  std::vector<std::uint32_t> fan(points_.size());
  fan_start_.assign(viewpoints_.size() * kDirections + 1, 0);
  cloud::for_each_chunk(points_.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (points_[i].viewpoint < 0) continue;
      fan[i] = static_cast<std::uint32_t>(static_cast<std::size_t>(points_[i].viewpoint) * kDirections +
                                          direction_of(points_[i]));
    }
  });
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].viewpoint >= 0) ++fan_start_[fan[i] + std::size_t{1}];
  }
  for (std::size_t i = 1; i < fan_start_.size(); ++i) fan_start_[i] += fan_start_[i - 1];
  by_view_.resize(fan_start_.back());
  std::vector<std::uint32_t> next(fan_start_.begin(), fan_start_.end() - 1);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].viewpoint >= 0) by_view_[next[fan[i]]++] = points_[i];
  }
}

std::vector<PlanPoints::Fan> PlanPoints::fans_towards(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                                      double reach) const {
  const double length = (b - a).norm();
  const Eigen::Vector2d along = length > 0 ? ((b - a) / length).eval() : Eigen::Vector2d::UnitX();
  std::vector<std::size_t> views;
  for (std::size_t v = 0; v < viewpoints_.size(); ++v) {
    const Eigen::Vector2d eye = viewpoints_[v].head<2>().cast<double>();
    const Eigen::Vector2d nearest = a + std::clamp(along.dot(eye - a), 0.0, length) * along;
    if ((eye - nearest).norm() <= reach) views.push_back(v);
  }
  std::vector<Fan> fans;
  for (const std::size_t v : views) {
    const std::uint32_t* const start = fan_start_.data() + v * kDirections;
    const std::size_t rays = std::max(kRays / views.size(), std::min(kRaysOfView, kMaxRays / views.size()));
    const auto stride =
        static_cast<std::uint32_t>(std::max<std::size_t>(1, (start[kDirections] - start[0]) / rays));
    const Eigen::Vector2d eye = viewpoints_[v].head<2>().cast<double>();
    const auto direction = [&](const Eigen::Vector2d& p) {
      return (std::atan2(p.y() - eye.y(), p.x() - eye.x()) / (2 * EIGEN_PI) + 0.5) * kDirections;
    };
    // The shorter way around, widened by one direction on either side.
    double first = direction(a), last = direction(b);
    if (std::abs(last - first) > 0.5 * kDirections) (first < last ? first : last) += kDirections;
    if (first > last) std::swap(first, last);
    const auto low = static_cast<std::size_t>(std::max(0.0, std::floor(first) - 1 + kDirections));
    const auto high =
        std::min(static_cast<std::size_t>(std::floor(last) + 1 + kDirections), low + kDirections - 1);
    for (std::size_t d = low; d <= high;) {
      const std::size_t from = d % kDirections, to = std::min(kDirections, from + (high - d) + 1);
      fans.push_back({start[from], start[to], stride, v});
      d += to - from;
    }
  }
  return fans;
}

bool WallRaster::covered(int c, int r) const {
  for (int y = std::max(r - 1, 0); y <= std::min(r + 1, rows - 1); ++y) {
    for (int x = std::max(c - 1, 0); x <= std::min(c + 1, columns - 1); ++x) {
      if (measured[at(x, y)] > 0) return true;
    }
  }
  return false;
}

WallRaster::Fractions WallRaster::fractions(int c0, int c1, double z0, double z1) const {
  Fractions sum;
  c0 = std::max(c0, 0), c1 = std::min(c1, columns);
  for (int r = std::max(row_of(z0 + 0.5 * row), 0); r < std::min(row_of(z1 + 0.5 * row), rows); ++r) {
    for (int c = c0; c < c1; ++c) {
      const std::size_t i = at(c, r);
      ++sum.cells;
      sum.rays += through[i], sum.crossed += crossed[i], sum.hidden += hidden[i],
          sum.points += measured[i] + behind[i];
      if (covered(c, r))
        sum.measured += 1;
      else if (behind[i] > 0)
        sum.behind += 1;
      else if (through[i] > 0)
        sum.through += 1;
    }
  }
  if (sum.cells > 0) sum.measured /= sum.cells, sum.behind /= sum.cells, sum.through /= sum.cells;
  return sum;
}

namespace {

/// The visible side of a line, by its normal: the one from which most of the points on it were measured;
/// without viewpoints, the one with most of the nearby cloud.
double visible_side(const PlanPoints& points, const Eigen::Vector2d& start, const Eigen::Vector2d& end,
                    const Eigen::Vector2d& normal, double near) {
  constexpr double kNearby = 2.0;  // m
  const double inner = (points.any_unplaced() ? kRecessMost : near) + PlanPoints::kCellRadius;
  double side = 0;
  points.cells_near(
      start, end, kNearby, [&](const Eigen::Vector2d& centre, std::span<const PlanPoints::Point> in_cell) {
        const double offset_of_cell = normal.dot(centre - start);
        if (std::abs(offset_of_cell) > inner) {  // so are all of its points, on the same side
          if (!points.any_unplaced()) return;
          const auto unplaced = std::count_if(in_cell.begin(), in_cell.end(),
                                              [](const PlanPoints::Point& p) { return p.viewpoint < 0; });
          side += static_cast<double>(offset_of_cell > 0 ? unplaced : -unplaced);
          return;
        }
        for (const PlanPoints::Point& point : in_cell) {
          const double offset = normal.dot(point.p.head<2>().cast<double>() - start);
          if (point.viewpoint < 0) {
            if (std::abs(offset) > kRecessMost) side += offset > 0 ? 1 : -1;
          } else if (std::abs(offset) <= near) {
            const Eigen::Vector3f& from = points.viewpoints()[static_cast<std::size_t>(point.viewpoint)];
            side += normal.dot(from.head<2>().cast<double>() - start) > 0 ? 1 : -1;
          }
        }
      });
  return side;
}

/// Counts the points on, behind and, without viewpoints, before the wall in its cells.
void count_points(const PlanPoints& points, const Eigen::Vector2d& end, double near, WallRaster& wall) {
  std::vector<double> depth(static_cast<std::size_t>(wall.columns), 0);
  std::vector<int> deep(static_cast<std::size_t>(wall.columns), 0);
  std::vector<std::vector<float>> offsets(static_cast<std::size_t>(wall.columns));
  const auto count_point = [&](const PlanPoints::Point& point, double offset, double at, double over) {
    const int c = cloud::floor_index(at / wall.column), r = cloud::floor_index(over / wall.row);
    if (c >= wall.columns || r >= wall.rows) return;
    if (std::abs(offset) <= near) {
      count(wall.measured, wall.at(c, r));
      if (point.p.z() > wall.z_low + kFaceFrom && point.p.z() < wall.z_low + kFaceTo)
        offsets[static_cast<std::size_t>(c)].push_back(static_cast<float>(offset));
    } else if (offset < -near && point.viewpoint < 0) {
      ++wall.hidden[wall.at(c, r)];
    } else if (offset > near) {
      count(wall.behind, wall.at(c, r));
      depth[static_cast<std::size_t>(c)] += offset;
      ++deep[static_cast<std::size_t>(c)];
    }
  };
  PointBatch batch(wall, kFront, kRecessMost);
  const double before = points.any_unplaced() ? kFront : near, radius = PlanPoints::kCellRadius;
  points.cells_near(wall.start, end, kFront,
                    [&](const Eigen::Vector2d& centre, std::span<const PlanPoints::Point> in_cell) {
                      const double offset = wall.away.dot(centre - wall.start),
                                   at = wall.along.dot(centre - wall.start);
                      if (offset < -before - radius || offset > kRecessMost + radius) return;
                      if (at < -radius || at > wall.columns * wall.column + radius) return;
                      batch.for_each_within(in_cell, count_point);
                    });
  for (std::size_t c = 0; c < depth.size(); ++c)
    wall.depth.push_back(deep[c] > 0 ? static_cast<float>(depth[c] / deep[c]) : 0.F);
  for (std::vector<float>& of_column : offsets) {
    wall.face.push_back(of_column.size() < kFacePoints ? std::numeric_limits<float>::quiet_NaN()
                                                       : median(of_column));
  }
}

}  // namespace

WallRaster rasterize(const PlanPoints& points, const Eigen::Vector2d& start, const Eigen::Vector2d& end,
                     double z_low, double z_high, double near) {
  WallRaster wall;
  wall.start = start;
  wall.along = (end - start).normalized();
  wall.z_low = z_low;
  wall.columns = std::max(1, static_cast<int>(std::lround((end - start).norm() / wall.column)));
  wall.rows = std::max(1, static_cast<int>(std::ceil((z_high - z_low) / wall.row)));
  const Eigen::Vector2d normal(-wall.along.y(), wall.along.x());
  wall.away = visible_side(points, start, end, normal, near) > 0 ? -normal : normal;

  const auto cells = static_cast<std::size_t>(wall.columns) * static_cast<std::size_t>(wall.rows);
  wall.measured.assign(cells, 0);
  wall.behind.assign(cells, 0);
  wall.through.assign(cells, 0);
  wall.crossed.assign(cells, 0);
  wall.hidden.assign(cells, 0);
  count_points(points, end, near, wall);

  wall.viewpoints_known = points.has_rays();
  // The last column may extend slightly past the end; from close by that is a wide angle.
  const Eigen::Vector2d edge = start + wall.columns * wall.column * wall.along;
  points.rays_towards(
      start, edge, kSight,
      [&](const Eigen::Vector3f& viewpoint, std::span<const PlanPoints::Point> ends, std::uint32_t n) {
        RayBatch batch(wall, viewpoint.cast<double>(), near, kBeyond);
        batch.for_each_hit(ends, n, [&](double at, double over, bool through) {
          const int c = cloud::floor_index(at / wall.column), r = cloud::floor_index(over / wall.row);
          if (c >= wall.columns || r >= wall.rows) return;
          if (through) count(wall.through, wall.at(c, r));
          (through ? wall.crossed : wall.hidden)[wall.at(c, r)] += n;
        });
      });
  return wall;
}

}  // namespace parhelion::semantic

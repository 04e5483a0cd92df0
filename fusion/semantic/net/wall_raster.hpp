// A vertical plane cut into cells: measured surface, looked through by a scanner, or unobserved. The paper's
// cubes (figure 5), laid along a wall. Internal to the semantic net.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Points of a cloud by position in the plan, with the rays that measured them; thinned where there are many.
class PlanPoints {
 public:
  /// Keeps every n-th point, at least `enough` or a quarter of them.
  explicit PlanPoints(const cloud::PointCloud<Map>& cloud, std::size_t enough = 1'000'000);

  static constexpr double kCellRadius = 0.375;  ///< m, a little more than half of a cell's diagonal

  struct Point {
    Eigen::Vector3f p = Eigen::Vector3f::Zero();  ///< m, map frame
    std::int32_t viewpoint = -1;                  ///< into viewpoints(); -1: unknown
  };
  const std::vector<Eigen::Vector3f>& viewpoints() const { return viewpoints_; }
  const std::vector<Point>& all() const { return points_; }
  bool has_rays() const { return !by_view_.empty(); }

  /// For each viewpoint from which rays come within `reach` of the segment from a to b and past it in the
  /// plan (and some beside it), calls visit(viewpoint, points, n): every n-th of the points, from the first,
  /// ends such a ray; n is 1 but where they are very many. The cost of a wall depends only on its
  /// surroundings, not on the size of the site.
  template <class Visit>
  void rays_towards(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double reach, Visit&& visit) const {
    for (const Fan& fan : fans_towards(a, b, reach)) {
      visit(viewpoints_[fan.view], std::span(by_view_).subspan(fan.begin, fan.end - fan.begin), fan.stride);
    }
  }

  /// Calls visit(centre, points) for each plan cell with points that lies within `reach` of the segment from
  /// a to b. No point of it is farther than kCellRadius from the centre.
  template <class Visit>
  void cells_near(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double reach, Visit&& visit) const {
    const Eigen::Vector2d low = a.cwiseMin(b).array() - reach, high = a.cwiseMax(b).array() + reach;
    const Eigen::Vector2d along = (b - a).normalized();
    const Eigen::Vector2i first = cell_of(low).cwiseMax(0),
                          last = cell_of(high).cwiseMin(cells_.array().matrix() - Eigen::Vector2i::Ones());
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const std::size_t i =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(cells_.x()) + static_cast<std::size_t>(x);
        if (start_[i] == start_[i + 1]) continue;
        const Eigen::Vector2d centre = low_ + kCell * (Eigen::Vector2d(x, y).array() + 0.5).matrix();
        const Eigen::Vector2d d = centre - a;
        if (std::abs(along.x() * d.y() - along.y() * d.x()) > reach + kCellRadius) continue;
        visit(centre, std::span(points_).subspan(start_[i], start_[i + 1] - start_[i]));
      }
    }
  }
  /// Calls visit(point) for each point of these cells.
  template <class Visit>
  void near_segment(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double reach, Visit&& visit) const {
    cells_near(a, b, reach, [&](const Eigen::Vector2d&, std::span<const Point> points) {
      for (const Point& point : points) visit(point);
    });
  }
  /// Whether it is not known of some points from where they were seen.
  bool any_unplaced() const { return any_unplaced_; }

 private:
  static constexpr double kCell = 0.5;             ///< m
  static constexpr std::size_t kDirections = 256;  ///< around a viewpoint
  /// Points of one view in adjacent directions: a range of by_view_.
  struct Fan {
    std::uint32_t begin = 0, end = 0, stride = 1;
    std::size_t view = 0;
  };
  std::vector<Fan> fans_towards(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double reach) const;
  void sort_by_direction();
  std::size_t direction_of(const Point& point) const;
  Eigen::Vector2i cell_of(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d at = (p - low_) / kCell;
    return {cloud::floor_index(at.x()), cloud::floor_index(at.y())};
  }
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  Eigen::Vector2i cells_ = Eigen::Vector2i::Zero();
  std::vector<Point> points_;  ///< sorted by cell
  bool any_unplaced_ = false;
  std::vector<std::uint32_t> start_;
  std::vector<Eigen::Vector3f> viewpoints_;
  std::vector<Point> by_view_;            ///< those with a viewpoint, by it, then direction
  std::vector<std::uint32_t> fan_start_;  ///< per view and direction, and one more: into by_view_
};

/// Cells of a wall's plane: columns along it, rows upwards.
struct WallRaster {
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), along = Eigen::Vector2d::UnitX();  ///< m; unit
  Eigen::Vector2d away = Eigen::Vector2d::UnitY();  ///< unit, across the wall, to the far side
  double z_low = 0;                                 ///< m, lower edge of row 0
  double column = 0.05, row = 0.1;                  ///< m
  int columns = 0, rows = 0;
  bool viewpoints_known = false;        ///< viewpoints are known, so `through` is valid
  std::vector<std::uint16_t> measured;  ///< points within `near` of the plane
  std::vector<std::uint16_t> behind;    ///< points 5 to 40 cm behind it: a recess
  std::vector<std::uint16_t> through;   ///< rays that crossed it and continued by half a metre or more
  /// Sums over the followed rays: those that crossed the cell, and those that would have crossed it if
  /// nothing in front of the plane had stopped them. Without viewpoints, `hidden` has points up to 0.8 m
  /// before the plane.
  std::vector<std::uint32_t> crossed, hidden;
  std::vector<float> depth;  ///< m, per column: mean of `behind`
  std::vector<float>
      face;  ///< m behind the plane, per column: median of `measured` below a lintel; NaN: too few

  std::size_t at(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c);
  }
  int row_of(double z) const { return static_cast<int>(std::floor((z - z_low) / row)); }

  /// Fractions of the cells of columns [c0, c1) and heights [z0, z1) that are measured (or touch a measured
  /// one, as a scan's lines leave gaps), else recessed, else seen through.
  struct Fractions {
    double measured = 0, behind = 0, through = 0;
    int cells = 0;
    int rays = 0;    ///< that passed through
    int points = 0;  ///< `measured` and `behind`
    std::uint32_t crossed = 0, hidden = 0;
  };
  bool covered(int c, int r) const;
  Fractions fractions(int c0, int c1, double z0, double z1) const;
};

/// The raster of the plane over start..end between two heights. `near`: m, a point this near is on it; less
/// than the depth of a recess.
WallRaster rasterize(const PlanPoints& points, const Eigen::Vector2d& start, const Eigen::Vector2d& end,
                     double z_low, double z_high, double near);

}  // namespace parhelion::semantic

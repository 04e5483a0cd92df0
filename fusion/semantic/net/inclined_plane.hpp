// A plane that is neither level nor upright, and what lies on it. Internal to the semantic net.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

namespace parhelion::semantic {

/// A plane with coordinates on it: u uphill, v to the left of it, m, from its centre.
struct InclinedPlane {
  static constexpr double kOn = 0.08;    ///< m, of a point on it
  static constexpr double kCell = 0.25;  ///< m, of its own raster
  using Place = std::pair<int, int>;

  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();  ///< m; unit, upwards
  Eigen::Vector3d uphill = Eigen::Vector3d::UnitX(), left = Eigen::Vector3d::UnitY();   ///< unit
  std::set<Place> squares;     ///< of the plan, that it lies over
  std::map<Place, int> cells;  ///< (v, u) of its raster: points on it, at least three
  Eigen::AlignedBox2d extent;  ///< m, (v, u) of the points on it
  double confidence = 0;       ///< that it is a ceiling, 0 to 1

  double off(const Eigen::Vector3d& p) const { return normal.dot(p - centre); }  ///< m
  Eigen::Vector2d at(const Eigen::Vector3d& p) const {
    return {left.dot(p - centre), uphill.dot(p - centre)};
  }
  Place cell_of(const Eigen::Vector3d& p) const;
  double height(double u) const { return centre.z() + kCell * u * uphill.z(); }  ///< m; u: in cells
  bool contains(const Eigen::Vector3d& p) const;  ///< on it, in one of its cells or beside one
};

/// Which planes lie over which squares of the plan.
class PlanesByPlace {
 public:
  explicit PlanesByPlace(const std::vector<InclinedPlane>& planes);
  static InclinedPlane::Place square_of(const Eigen::Vector3d& p);
  /// Numbers of those over a square or one beside it, ascending.
  std::span<const std::uint32_t> over(const InclinedPlane::Place& square) const;

 private:
  std::map<InclinedPlane::Place, std::vector<std::uint32_t>> planes_;
};

/// Whether a point with this EntityLabel may be one of an inclined ceiling.
bool may_be_ceiling(std::uint8_t label);

}  // namespace parhelion::semantic

// Fields of radiation sources and gas leaks in a building.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "protocols/hazard.hpp"
#include "server/simulation/building/planar.hpp"

namespace parhelion::simulation {

class Building;
struct Door;

/// Boxes of the building, doors at their current angles, between two points (m, map). Meshes are not counted:
/// furniture attenuates neither much.
struct Crossing {
  int walls = 0;         ///< boxes of any label on the line
  double thickness = 0;  ///< m of the line within them
};
Crossing crossing(const Building& building, const std::vector<Door>& doors, const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b);

/// uSv/h at `distance` m from a source behind `thickness` m of wall: inverse square, halved by each
/// half-value layer (NCRP Report 49, 1976: broad beams, so scattered radiation is in the layer); nearer than
/// 0.1 m as at 0.1 m.
double dose_rate(const Hazard& source, double distance, double thickness);

/// Distance through the air from a leak, in the plane and round walls: the straight line where it is free,
/// else over an 8-connected grid (at most 8 % too long). Modelled doors do not block gas. The
/// concentration falls to 1/e in each `reach` of distance: a steady leak in a draught, not a flow simulation.
class GasField {
 public:
  static constexpr double kReaches = 5;  ///< beyond this many (0.7 %) the reading is 0

  /// Computes the field of a leak, or keeps it if the leak moved less than a cell.
  void place(const Building& building, const Eigen::Vector3d& leak, double reach);
  /// ppm at `p`, for `strength` ppm at the leak; 0 without a path.
  double concentration(const Building& building, double strength, const Eigen::Vector3d& p) const;

 private:
  bool blocked(const Building& building, const Footprint& line) const;
  void spread();
  double distance_over_grid(const Building& building, const Eigen::Vector2d& p) const;
  const Building* building_ = nullptr;
  Eigen::Vector3d leak_ = Eigen::Vector3d::Zero();
  double reach_ = 1, cell_ = 0.25;
  int side_ = 0;                  ///< cells along each side, the leak in the middle
  std::vector<char> solid_;       ///< by cell, row by row
  std::vector<double> distance_;  ///< m, by cell; infinity: no path
};

}  // namespace parhelion::simulation

// How far the fields of radiation sources and gas leaks reach through a building.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "protocols/hazard.hpp"
#include "server/simulation/planar.hpp"

namespace parhelion::simulation {

class Building;
struct Door;

/// What the boxes of the building, doors as they stand now, put between two points (m, map). Meshes are not
/// counted: furniture weakens neither much.
struct Crossing {
  int walls = 0;         ///< boxes of any label that the line passes through
  double thickness = 0;  ///< m of the line within them
};
Crossing crossing(const Building& building, const std::vector<Door>& doors, const Eigen::Vector3d& a,
                  const Eigen::Vector3d& b);

/// uSv/h at `distance` m from a source behind `thickness` m of wall: inverse square, halved by each
/// half-value layer (NCRP Report 49, 1976: broad beams, so scattered radiation is in the layer); nearer than
/// 0.1 m as at 0.1 m.
double dose_rate(const Hazard& source, double distance, double thickness);

/// How far it is through the air from a leak, in the plane and round walls: where nothing is between the
/// straight line, else over a grid of 8 neighbours (at most 8 % too long). Modelled doors stand open to gas.
/// Concentration falls to 1/e in each `reach` of way: a steady leak into a draught, not a solution of flow.
class GasField {
 public:
  static constexpr double kReaches = 5;  ///< beyond so many (0.7 %) nothing is read

  /// Makes the field of a leak there, or keeps it where the leak moved less than a cell.
  void place(const Building& building, const Eigen::Vector3d& leak, double reach);
  /// ppm at `p`, for `strength` ppm at the leak; 0 where no way leads.
  double concentration(const Building& building, double strength, const Eigen::Vector3d& p) const;

 private:
  bool blocked(const Building& building, const Footprint& line) const;
  void spread();
  double way_over_grid(const Building& building, const Eigen::Vector2d& p) const;
  const Building* building_ = nullptr;
  Eigen::Vector3d leak_ = Eigen::Vector3d::Zero();
  double reach_ = 1, cell_ = 0.25;
  int side_ = 0;             ///< cells along each side, the leak in the middle
  std::vector<char> solid_;  ///< by cell, row by row
  std::vector<double> way_;  ///< m, by cell; infinity: no way
};

}  // namespace parhelion::simulation

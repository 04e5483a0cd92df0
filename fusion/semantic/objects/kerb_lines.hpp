// Lines along which a step of a kerb's height may lie, from the layers of plan cells. Internal to this
// module.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fusion/semantic/net/ground_layers.hpp"

namespace parhelion::semantic {

constexpr double kShortestKerb = 1.5;  ///< m
constexpr double kKerbGap = 2.0;       ///< m, that nothing was measured over

/// Coordinates at a line of the plan: u along it, v towards its higher side; m.
struct KerbAxis {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero(), along = Eigen::Vector2d::UnitX(),
                  up = Eigen::Vector2d::UnitY();
  double from = 0, to = 0;  ///< m, along it
  Eigen::Vector2d at(const Eigen::Vector2d& p) const { return {along.dot(p - origin), up.dot(p - origin)}; }
  Eigen::Vector2d place(double u) const { return origin + u * along; }
};

/// A lower and a higher ground on two sides of a line.
struct KerbLine {
  KerbAxis line;
  SlopedPlane low;  ///< the higher ground is parallel to it
  double rise = 0;  ///< m
};

/// Lines between two level layers of ground whose step is higher than `lowest` (m) and lower than 25 cm; the
/// longest of a group of steps first (as in RANSAC, but through a fixed choice of pairs: Fischler and Bolles
/// 1981). The number of a group's lines is bounded, so rough terrain costs no more than its size.
std::vector<KerbLine> kerb_lines(const GroundLayers& ground, double lowest);

}  // namespace parhelion::semantic

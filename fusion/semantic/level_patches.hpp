// Small planar patches of a cloud, and the heights at which many of them lie level.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "protocols/angle_units.hpp"

namespace parhelion::semantic {

inline constexpr double kPatchSide = 0.25;  // m; less than the tread of a step
inline constexpr double kLevelWithin = 6 * kRadiansPerDegree;
inline constexpr double kUprightWithin = 4 * kRadiansPerDegree;

/// The points of one cube of the cloud.
struct PlanePatch {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  int count = 0;

  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  bool planar = false;
};

/// Cubes of the cloud with the plane through the points of each; in the order of first appearance.
std::vector<PlanePatch> patches_of(const std::vector<Eigen::Vector3f>& points);

bool is_upright(const Eigen::Vector3d& normal, const Eigen::Vector3d& up);
bool is_upright(const PlanePatch& patch, const Eigen::Vector3d& up);

struct PatchLayer {
  double height = 0;  ///< m
  int patches = 0;
};

/// Heights (m along `up`, unit) of level patches, those with the most patches first.
std::vector<PatchLayer> layers_of(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up,
                                  double thickness = 0.10);

}  // namespace parhelion::semantic

// Directions in which surfaces hardly determine the pose, as along a corridor. There a scan says little, and
// one scan after the other says the same.
#pragma once

#include <Eigen/Core>

#include "protocols/pose2.hpp"

namespace parhelion::pose {

/// How much of what a scan shows of weak directions is new after a motion, 0 to 1: all of it after `metres`,
/// or as many radians. Until then the same edges, and the same things that the map does not have, pull each
/// scan the same way, so that the errors of its matches do not average out.
double new_fraction(const Pose2& step, double metres = 1);

struct Estimate2 {
  Pose2 T_map_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< x, y, yaw; map frame; m^2, m rad, rad^2
};

/// The part of a motion of the pose (x, y, yaw; map frame) that the points of a match determine well, as a
/// matrix that it is multiplied with. `information`: as Match::information. `sigma`: m, formal 1 sigma of one
/// scan; directions with less are determined by surfaces. The default was chosen on the buildings of
/// tests/fusion/pose/repeating_building.hpp (seeds 31 to 38, four new cupboards in each room) and on UAL.
Eigen::Matrix3d strong_directions(const Eigen::Matrix3d& information, double sigma = 0.02);

/// Joins a prediction and a match. `information` is that of the match's points alone (as Match::information),
/// and `prior` is what the match was made with, about the predicted pose. Strong directions are taken from
/// `matched`. In the others `predicted` is held, with its own covariance, which may be narrower than `prior`,
/// against the fraction `fresh` of what the points say. `sigma`: as for strong_directions().
Estimate2 joined(const Estimate2& predicted, const Eigen::Matrix3d& prior, const Pose2& matched,
                 const Eigen::Matrix3d& information, double fresh, double sigma = 0.02);

}  // namespace parhelion::pose

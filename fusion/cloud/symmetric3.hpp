// The plane through scattered points, in closed form: a general solver would dominate the time of surfels.
#pragma once

#include <Eigen/Core>

namespace parhelion::cloud {

/// Smallest eigenvalue of a symmetric, positive semidefinite 3x3 matrix, with its eigenvector.
struct SmallestEigen {
  double smallest = 0, middle = 0;  ///< eigenvalues
  Eigen::Vector3d vector;  ///< unit, of the smallest eigenvalue; any in its eigenspace where two are equal
};

/// The matrix is given by its diagonal (xx, yy, zz) and off-diagonal elements (xy, xz, yz). All zero: UnitZ.
SmallestEigen smallest_eigen(const Eigen::Vector3d& diagonal, const Eigen::Vector3d& beside);

}  // namespace parhelion::cloud

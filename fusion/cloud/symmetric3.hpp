// The plane of a scatter of points, in closed form: a general solver takes most of the time of surfels.
#pragma once

#include <Eigen/Core>

namespace parhelion::cloud {

/// Of a symmetric, positive semidefinite 3x3 matrix.
struct LeastEigen {
  double least = 0, middle = 0;  ///< eigenvalues
  Eigen::Vector3d vector;        ///< unit, of the least one; any of its plane where both are equal
};

/// The matrix is given by its diagonal (xx, yy, zz) and what is beside it (xy, xz, yz). All zero: UnitZ.
LeastEigen least_eigen(const Eigen::Vector3d& diagonal, const Eigen::Vector3d& beside);

}  // namespace parhelion::cloud

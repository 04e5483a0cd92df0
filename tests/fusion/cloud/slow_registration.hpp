// Reference implementation of register_pair: the same cost function (point-to-plane, Geman and McClure's
// kernel, partners with similar normals) over all points, without surfels, resolutions or cached partners.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/cloud/parallel.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::test {

struct SlowRegistration {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  double kernel = 0;  ///< m, of the last iterations
  int iterations = 0;
  bool converged = false;
};

class SlowRegistrar {
 public:
  /// Each cloud in its scanner's frame; `size` as RegistrationOptions::surfel_size, m.
  SlowRegistrar(const std::vector<Eigen::Vector3f>& target, const std::vector<Eigen::Vector3f>& source,
                double size)
      : size_(size), target_(target, size), source_(source, size) {}

  /// Iterates to convergence; the search radius shrinks to that of the default.
  SlowRegistration run(const Eigen::Isometry3d& guess, double max_distance) const {
    SlowRegistration result{guess};
    for (double gate = max_distance;; gate = std::max(gate / 2, 2.5 * size_)) {
      const bool last = gate <= 2.5 * size_;
      converge(result, gate, last ? size_ / 2 : gate);
      if (!last) continue;
      result.kernel = fitted_kernel(result.T, gate);
      converge(result, gate, result.kernel);
      return result;
    }
  }

 private:
  /// Points with the planes of their neighbours within 1.5 sizes along each axis.
  struct Planes {
    cloud::BucketGrid grid;
    std::vector<Eigen::Vector3d> normals;
    std::vector<double> slack;     ///< as in Surfels
    std::vector<double> fraction;  ///< weight by area: each cube counts once, whatever its density

    Planes(const std::vector<Eigen::Vector3f>& points, double size)
        : grid(points, 0.5 * size), normals(points.size()), slack(points.size(), 1), fraction(points.size()) {
      const cloud::BucketGrid cubes(points, size);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector3i cube =
            cubes.bucket_of(grid.sorted()[i]).cwiseMin(cubes.buckets() - Eigen::Vector3i::Ones());
        const cloud::BucketGrid::Range all = cubes.row(cube.x(), cube.x(), cube.y(), cube.z());
        fraction[i] = 1.0 / (all.end - all.begin);
      }
      cloud::for_each_chunk(points.size(), 512, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) fit(i, 1.5 * size);
      });
    }

    void fit(std::size_t i, double window) {
      const Eigen::Vector3f p = grid.sorted()[i];
      double n = 0;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
      visit(p, static_cast<float>(window), [&](std::size_t j) {
        const Eigen::Vector3d d = (grid.sorted()[j] - p).cast<double>();
        if (d.cwiseAbs().maxCoeff() > window) return;
        n += 1;
        sum += d;
        squares += d * d.transpose();
      });
      if (n < 6) return;
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(squares / n -
                                                                  sum * sum.transpose() / (n * n));
      if (!(solver.eigenvalues()[1] > 0)) return;
      const double ratio = std::max(0.0, solver.eigenvalues()[0]) / solver.eigenvalues()[1];
      slack[i] = std::clamp(ratio * ratio, 1e-3, 1.0);
      normals[i] = solver.eigenvectors().col(0);
      if (normals[i].dot(p.cast<double>()) > 0) normals[i] = -normals[i];  // towards the scanner
    }

    /// All points in the buckets within `reach` of p, and some beyond.
    template <class Visit>
    void visit(const Eigen::Vector3f& p, float reach, const Visit& visit_one) const {
      const Eigen::Array3f around = Eigen::Array3f::Constant(reach + 1e-4f);
      const Eigen::Vector3i low = grid.bucket_of(p.array() - around).cwiseMax(0);
      const Eigen::Vector3i high =
          grid.bucket_of(p.array() + around).cwiseMin(grid.buckets() - Eigen::Vector3i::Ones());
      for (int z = low.z(); z <= high.z(); ++z) {
        for (int y = low.y(); y <= high.y(); ++y) {
          const cloud::BucketGrid::Range run = grid.row(low.x(), high.x(), y, z);
          for (std::size_t j = run.begin; j < run.end; ++j) visit_one(j);
        }
      }
    }
  };

  struct Sum {
    Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
    std::vector<double> residuals;  ///< m
    Sum& operator+=(const Sum& other) {
      H += other.H;
      b += other.b;
      residuals.insert(residuals.end(), other.residuals.begin(), other.residuals.end());
      return *this;
    }
  };

  /// The nearest point of the target with a similar normal; -1: none within the gate.
  std::ptrdiff_t partner(const Eigen::Vector3f& p, const Eigen::Vector3d& n, bool flat, double gate) const {
    std::ptrdiff_t found = -1;
    for (double reach = std::min(gate, 0.25 * size_);; reach = std::min(gate, 2 * reach)) {
      auto nearest = static_cast<float>(reach * reach);
      target_.visit(p, static_cast<float>(reach), [&](std::size_t j) {
        const float d2 = (target_.grid.sorted()[j] - p).squaredNorm();
        if (!(d2 < nearest)) return;
        if (flat && target_.slack[j] < 0.25 && n.dot(target_.normals[j]) < 0.5) return;
        nearest = d2;
        found = static_cast<std::ptrdiff_t>(j);
      });
      if (found >= 0 || reach >= gate) return found;
    }
  }

  Sum round(const Eigen::Isometry3d& T, double gate, double kernel) const {
    return cloud::sum_over_chunks<Sum>(
        source_.normals.size(), 512, 0, [&](std::size_t begin, std::size_t end) {
          Sum sum;
          for (std::size_t i = begin; i < end; ++i) {
            const Eigen::Vector3d p = T * source_.grid.sorted()[i].cast<double>();
            const Eigen::Vector3d n = T.linear() * source_.normals[i];
            const std::ptrdiff_t found = partner(p.cast<float>(), n, source_.slack[i] < 0.25, gate);
            if (found < 0) continue;
            const auto j = static_cast<std::size_t>(found);
            if (target_.slack[j] >= 0.25) continue;
            const Eigen::Vector3d& a = target_.normals[j];
            const double e = a.dot(target_.grid.sorted()[j].cast<double>() - p);
            const double root_weight = kernel * kernel / (kernel * kernel + e * e);
            Eigen::Matrix<double, 6, 1> row;
            row << a, (p - T.translation()).cross(a);
            const double weight = source_.fraction[i] * root_weight * root_weight;
            sum.H += weight * row * row.transpose();
            sum.b += weight * e * row;
            sum.residuals.push_back(std::abs(e));
          }
          return sum;
        });
  }

  double fitted_kernel(const Eigen::Isometry3d& T, double gate) const {
    std::vector<double> residuals = round(T, gate, size_).residuals;
    return std::clamp(3 * 1.4826 * median(residuals), size_ / 2, size_);
  }

  void converge(SlowRegistration& result, double gate, double kernel) const {
    constexpr int max_steps = 60;
    result.converged = false;
    for (int i = 0; i < max_steps && !result.converged; ++i) {
      const Sum sum = round(result.T, gate, kernel);
      const Eigen::Matrix<double, 6, 1> step = sum.H.ldlt().solve(sum.b);
      const Eigen::Vector3d centre = result.T.translation(), turn = step.tail<3>();
      const Eigen::Matrix3d R(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
      result.T.linear() = R * result.T.linear();
      result.T.translation() = centre + step.head<3>();
      ++result.iterations;
      result.converged = step.norm() < 1e-5;
    }
  }

  double size_;
  Planes target_, source_;
};

}  // namespace parhelion::test

#include "fusion/cloud/registration_verdict.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "fusion/cloud/free_space.hpp"
#include "fusion/cloud/parallel.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::cloud {
namespace {

// A correct alignment explains most of what both scans saw and contradicts very little: 1 contradicted per 7
// explained is 2 to 4 times what clutter and edges cause, and half of what the best wrong ones cause.
constexpr double kMaxContradiction = 0.15;
// Residuals spread evenly over the search radius (ratio 1) belong to unrelated surfaces.
constexpr double kMaxAmbiguity = 0.5;
// Surfels overlap with their neighbours in the window of their normals: about 9 on a surface are correlated.
constexpr double kSurfelsAlike = 9;
constexpr float kFlat = 0.05f;  // slack up to which a surfel counts as planar

std::string format(const char* pattern, double a, double b = 0) {
  std::array<char, 200> text;
  std::snprintf(text.data(), text.size(), pattern, a, b);
  return text.data();
}

std::string direction_text(const Eigen::Vector3d& v) {
  return format("(%.2f, %.2f, ", v.x(), v.y()) + format("%.2f)", v.z());
}

/// Directions determined by the planes of all flat pairs: lengths in units of `lever`, so that rotations and
/// translations are comparable.
struct PlaneInformation {
  Matrix6d sum = Matrix6d::Zero();
  double pairs = 0;

  PlaneInformation& operator+=(const PlaneInformation& other) {
    sum += other.sum;
    pairs += other.pairs;
    return *this;
  }
};

PlaneInformation plane_information(const AlignedPair& pair, const Eigen::Vector3d& centre, double lever,
                                   bool of_source) {
  constexpr std::size_t chunk = 1024;
  const Eigen::Isometry3d& T = pair.T_target_source;
  PlaneInformation planes = sum_over_chunks<PlaneInformation>(
      pair.source.count(), chunk, pair.options.threads, [&](std::size_t begin, std::size_t end) {
        PlaneInformation part;
        for (std::size_t i = begin; i < end; ++i) {
          if (pair.partners.partner(i) < 0) continue;
          const auto j = static_cast<std::size_t>(pair.partners.partner(i));
          if (pair.source.slack[i] > kFlat || pair.target.surfels.slack[j] > kFlat) continue;
          const Eigen::Vector3d n = of_source
                                        ? Eigen::Vector3d(T.linear() * pair.source.normals[i].cast<double>())
                                        : Eigen::Vector3d(pair.target.surfels.normals[j].cast<double>());
          const Eigen::Vector3d r = T * pair.source.means[i].cast<double>() - centre;
          Vector6d row;
          row << n, r.cross(n) / lever;
          for (int k = 0; k < 6; ++k) part.sum.col(k).head(k + 1) += row[k] * row.head(k + 1);
          part.pairs += 1;
        }
        return part;
      });
  planes.sum.triangularView<Eigen::StrictlyLower>() = planes.sum.transpose();
  return planes;
}

struct Undetermined {
  std::string words;                            ///< readable text; empty: everything is determined
  Matrix6d project_out = Matrix6d::Identity();  ///< from the known directions, in units of lever
};

/// Directions in which normals vary so little along the surfaces that noise alone could explain it.
Undetermined undetermined_directions(const PlaneInformation& planes, double normal_noise) {
  Undetermined result;
  if (planes.pairs < 6) return {"any direction: there are no flat surfaces in both", Matrix6d::Zero()};
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(planes.sum / planes.pairs);
  // Noise contributes the square of its angle to the mean squared cosine between a direction and the normals.
  const double noise_floor = 3 * normal_noise * normal_noise + 1e-4;
  for (int k = 0; k < 6 && solver.eigenvalues()[k] < noise_floor; ++k) {
    const Vector6d v = solver.eigenvectors().col(k);
    const bool turning = v.tail<3>().norm() > v.head<3>().norm();
    const Eigen::Vector3d axis = turning ? v.tail<3>().normalized() : v.head<3>().normalized();
    result.words += (result.words.empty() ? "" : "; ") +
                    std::string(turning ? "turning about " : "moving along ") + direction_text(axis);
    result.project_out -= v * v.transpose();
  }
  return result;
}

/// Converts from the moved source's centre, in units of lever, to the target's origin of the source (see
/// Registration).
Matrix6d covariance_of(const PlaneInformation& planes, double variance, double lever,
                       const Eigen::Vector3d& origin_from_centre) {
  Vector6d scale;
  scale << 1, 1, 1, lever, lever, lever;
  Matrix6d information = scale.asDiagonal() * planes.sum * scale.asDiagonal();
  // Undetermined directions keep an uncertainty of a lever, or a radian.
  information.diagonal().array() += 1e-9 * planes.pairs + 1e-12;
  for (int k = 0; k < 6; ++k) information(k, k) += k < 3 ? variance / (lever * lever) : variance;
  Matrix6d move = Matrix6d::Identity();
  const Eigen::Vector3d& o = origin_from_centre;
  move.topRightCorner<3, 3>() << 0, o.z(), -o.y(), -o.z(), 0, o.x(), o.y(), -o.x(), 0;
  const Matrix6d inverse = information.ldlt().solve(Matrix6d::Identity());
  const Matrix6d covariance = kSurfelsAlike * variance * move * inverse * move.transpose();
  return (covariance + covariance.transpose()) / 2;
}

double contradiction(const AlignedPair& pair) {
  // Along a grazing ray a surfel's neighbour is nearer by up to a few surfel sizes.
  const double margin = 3 * pair.source.size;
  FreeSpace sum, back;
  run_both(
      pair.options.threads,
      [&] {
        sum = free_space(pair.target.surfels, pair.target_viewpoints, pair.source, pair.T_target_source,
                         margin);
      },
      [&] {
        back = free_space(pair.source, pair.source_viewpoints, pair.target.surfels,
                          pair.T_target_source.inverse(Eigen::Isometry), margin);
      });
  sum += back;
  const double both = sum.in_front + sum.on_surface;
  return both > 0 ? sum.in_front / both : 0;
}

}  // namespace

AlignmentEvidence evidence(const AlignedPair& pair) {
  AlignmentEvidence result;
  std::vector<double> found =
      residuals(pair.target, pair.source, pair.partners, pair.T_target_source, pair.options.threads);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double squares = 0, on = 0, from_origin = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0) continue;
    const Eigen::Vector3d mean = pair.source.means[i].cast<double>();
    centre += mean;
    from_origin += mean.squaredNorm();
    if (found[i] > pair.source.size / 2) continue;
    squares += found[i] * found[i];
    on += 1;
  }
  if (on == 0) return result;
  std::erase_if(found, [](double e) { return e < 0; });
  const auto pairs = static_cast<double>(found.size());
  centre /= pairs;
  const double lever = std::sqrt(std::max(from_origin / pairs - centre.squaredNorm(), 1e-12));
  centre = pair.T_target_source * centre;

  result.overlap = on / static_cast<double>(pair.source.count());
  result.rms = std::sqrt(squares / on);
  result.ambiguity = median(found) / (pair.options.gate / 2);
  result.contradiction = contradiction(pair);
  PlaneInformation planes = plane_information(pair, centre, lever, false);
  const double window = 1.5 * pair.source.size;
  const double noise = std::max(pair.source.noise(), pair.target.surfels.noise());
  // A normal is estimated from the points of about 9 surfels.
  Undetermined open = undetermined_directions(planes, noise / window / 3);
  // Either cloud may have too few surfaces.
  if (open.words.empty())
    open = undetermined_directions(plane_information(pair, centre, lever, true), noise / window / 3);
  result.undetermined = open.words;
  // There the information is only noise and is dropped.
  planes.sum = open.project_out * planes.sum * open.project_out;
  result.covariance = covariance_of(planes, std::max(result.rms * result.rms, 1e-12), lever,
                                    pair.T_target_source.translation() - centre);
  return result;
}

std::string objection(const AlignmentEvidence& evidence, double min_overlap) {
  if (evidence.overlap < min_overlap) {
    return format("only %.0f %% of the source lies on the target, %.0f %% are required",
                  100 * evidence.overlap, 100 * min_overlap);
  }
  if (evidence.ambiguity > kMaxAmbiguity) {
    return format(
        "the surfaces are near each other but do not match: the median residual is %.0f %% of chance's",
        100 * evidence.ambiguity);
  }
  if (evidence.contradiction > kMaxContradiction * evidence.overlap) {
    return format(
        "%.0f %% of the surfaces would be in space that the other scanner saw through, with %.0f %% "
        "explained",
        100 * evidence.contradiction, 100 * evidence.overlap);
  }
  if (!evidence.undetermined.empty()) return "the surfaces do not determine " + evidence.undetermined;
  return {};
}

}  // namespace parhelion::cloud

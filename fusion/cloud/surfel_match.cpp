#include "fusion/cloud/surfel_match.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/parallel.hpp"

namespace parhelion {
namespace {

constexpr std::size_t chunk = 512;
constexpr float least_cosine = 0.5f;  // surfaces that face more than 60 degrees apart are not the same
constexpr float flat_enough = 0.25f;  // slack above which a normal says too little to compare it

/// What a pair weighs, by direction: the inverse of the sum of both covariances, of 1 m^2 within the surface
/// and of the slack along the normal (Segal et al. 2009, equation 2).
Eigen::Matrix3d weight_of(IcpMethod method, const Eigen::Vector3d& a, double slack_a,
                          const Eigen::Vector3d& b, double slack_b) {
  if (method == IcpMethod::point_to_point) return Eigen::Matrix3d::Identity();
  if (method == IcpMethod::point_to_plane)
    return slack_a < flat_enough ? Eigen::Matrix3d(a * a.transpose()) : Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d sum =
      2 * Eigen::Matrix3d::Identity() - (1 - slack_a) * a * a.transpose() - (1 - slack_b) * b * b.transpose();
  return sum.inverse();
}

/// Squared, in m^2: what the method minimises, scaled so that flat surfels give their distance.
double squared_residual(IcpMethod method, const Eigen::Matrix3d& M, const Eigen::Vector3d& d, double slacks) {
  return d.dot(M * d) * (method == IcpMethod::generalised ? slacks : 1);
}

struct Pair {
  Eigen::Vector3d p, d, a, b;
  double slack_a, slack_b;

  Pair(const SurfelTarget& target, std::size_t j, const Surfels& source, std::size_t i,
       const Eigen::Isometry3d& T)
      : p(T * source.means[i].cast<double>()),
        d(target.surfels.means[j].cast<double>() - p),
        a(target.surfels.normals[j].cast<double>()),
        b(T.linear() * source.normals[i].cast<double>()),
        slack_a(target.surfels.slack[j]),
        slack_b(source.slack[i]) {}
};

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

SurfelTarget::SurfelTarget(const Surfels& target, double bucket_size)
    : grid(target.means, bucket_size, std::max<std::size_t>(4096, 64 * target.count())) {
  surfels.size = target.size;
  surfels.oriented = target.oriented;
  surfels.means = grid.sorted();
  for (const std::uint32_t i : grid.order()) {
    surfels.normals.push_back(target.normals[i]);
    surfels.slack.push_back(target.slack[i]);
    surfels.counts.push_back(target.counts[i]);
    surfels.thickness.push_back(target.thickness[i]);
  }
}

NormalEquations& NormalEquations::operator+=(const NormalEquations& other) {
  H += other.H;
  b += other.b;
  cost += other.cost;
  pairs += other.pairs;
  squares += other.squares;
  weights += other.weights;
  return *this;
}

std::vector<std::int32_t> partners(const SurfelTarget& target, const Surfels& source,
                                   const Eigen::Isometry3d& T_target_source, const MatchOptions& options) {
  std::vector<std::int32_t> result(source.count(), -1);
  const Eigen::Matrix3f R = T_target_source.linear().cast<float>();
  const Eigen::Vector3f t = T_target_source.translation().cast<float>();
  const auto gate2 = static_cast<float>(options.gate * options.gate);
  const bool oriented = source.oriented && target.surfels.oriented;
  const auto& means = target.surfels.means;
  for_each_chunk(source.count(), chunk, options.threads,
                 [&](std::size_t, std::size_t begin, std::size_t end) {
                   for (std::size_t i = begin; i < end; ++i) {
                     const Eigen::Vector3f p = R * source.means[i] + t, n = R * source.normals[i];
                     const bool faces = source.slack[i] < flat_enough;
                     float nearest = gate2;
                     target.grid.for_each_run(target.grid.bucket_of(p), [&](BucketGrid::Range run) {
                       for (std::uint32_t j = run.begin; j < run.end; ++j) {
                         const float d2 = (means[j] - p).squaredNorm();
                         if (!(d2 < nearest)) continue;
                         if (faces && target.surfels.slack[j] < flat_enough) {
                           const float cosine = n.dot(target.surfels.normals[j]);
                           if ((oriented ? cosine : std::abs(cosine)) < least_cosine) continue;
                         }
                         nearest = d2;
                         result[i] = static_cast<std::int32_t>(j);
                       }
                     });
                   }
                 });
  return result;
}

double residual(const SurfelTarget& target, std::int32_t partner, const Surfels& source, std::size_t i,
                const Eigen::Isometry3d& T_target_source) {
  constexpr IcpMethod method = IcpMethod::generalised;
  const Pair pair(target, static_cast<std::size_t>(partner), source, i, T_target_source);
  const Eigen::Matrix3d M = weight_of(method, pair.a, pair.slack_a, pair.b, pair.slack_b);
  return std::sqrt(squared_residual(method, M, pair.d, pair.slack_a + pair.slack_b));
}

NormalEquations normal_equations(const SurfelTarget& target, const Surfels& source,
                                 const std::vector<std::int32_t>& partners,
                                 const Eigen::Isometry3d& T_target_source, const Eigen::Vector3d& centre,
                                 const MatchOptions& options) {
  const double kernel2 = options.kernel * options.kernel;
  return sum_over_chunks<NormalEquations>(
      source.count(), chunk, options.threads, [&](std::size_t begin, std::size_t end) {
        NormalEquations sum;
        for (std::size_t i = begin; i < end; ++i) {
          if (partners[i] < 0) continue;
          const Pair pair(target, static_cast<std::size_t>(partners[i]), source, i, T_target_source);
          const Eigen::Matrix3d M = weight_of(options.method, pair.a, pair.slack_a, pair.b, pair.slack_b);
          const double e2 = squared_residual(options.method, M, pair.d, pair.slack_a + pair.slack_b);
          const double say = kernel2 / (kernel2 + e2), weight = say * say;
          const Eigen::Vector3d r = pair.p - centre, Md = weight * M * pair.d;
          const Eigen::Matrix3d rx = cross_matrix(r), Mr = -weight * M * rx;
          sum.H.topLeftCorner<3, 3>() += weight * M;
          sum.H.topRightCorner<3, 3>() += Mr;
          sum.H.bottomRightCorner<3, 3>() += rx * Mr;
          sum.b.head<3>() += Md;
          sum.b.tail<3>() += r.cross(Md);
          sum.cost += say * e2;
          sum.pairs += 1;
          sum.squares += weight * e2;
          sum.weights += weight;
        }
        sum.H.bottomLeftCorner<3, 3>() = sum.H.topRightCorner<3, 3>().transpose();
        return sum;
      });
}

Eigen::Isometry3d stepped(const Eigen::Isometry3d& T, const Vector6d& step, const Eigen::Vector3d& centre) {
  const double angle = step.tail<3>().norm();
  const Eigen::Matrix3d R = angle > 0 ? Eigen::AngleAxisd(angle, step.tail<3>() / angle).toRotationMatrix()
                                      : Eigen::Matrix3d::Identity();
  Eigen::Isometry3d result = T;
  result.linear() = Eigen::Quaterniond(R * T.linear()).normalized().toRotationMatrix();
  result.translation() = centre + R * (T.translation() - centre) + step.head<3>();
  return result;
}

}  // namespace parhelion

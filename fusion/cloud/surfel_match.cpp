#include "fusion/cloud/surfel_match.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/parallel.hpp"

namespace parhelion::cloud {
namespace {

constexpr std::size_t kChunk = 512;
constexpr float kFlatEnough = PartnerSearch::kFlatEnough;

/// The weight of a pair by direction: the inverse of the sum of both covariances, of 1 m^2 within the surface
/// and of the slack along the normal (Segal et al. 2009, equation 2).
Eigen::Matrix3d weight_of(IcpMethod method, const Eigen::Vector3d& a, double slack_a,
                          const Eigen::Vector3d& b, double slack_b) {
  if (method == IcpMethod::point_to_point) return Eigen::Matrix3d::Identity();
  if (method == IcpMethod::point_to_plane)
    return slack_a < kFlatEnough ? Eigen::Matrix3d(a * a.transpose()) : Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d sum =
      2 * Eigen::Matrix3d::Identity() - (1 - slack_a) * a * a.transpose() - (1 - slack_b) * b * b.transpose();
  return sum.inverse();
}

/// m^2, the squared residual that the method minimises, scaled so that flat surfels give their distance.
double squared_residual(IcpMethod method, const Eigen::Matrix3d& M, const Eigen::Vector3d& d, double slacks) {
  return d.dot(M * d) * (method == IcpMethod::generalised ? slacks : 1);
}

struct Pair {
  Eigen::Vector3d p, d, a;
  double slack_a, slack_b;
  Eigen::Vector3d b;

  Pair(const SurfelTarget& target, std::size_t j, const Surfels& source, std::size_t i,
       const Eigen::Isometry3d& T)
      : p(T * source.means[i].cast<double>()),
        d(target.surfels.means[j].cast<double>() - p),
        a(target.surfels.normals[j].cast<double>()),
        slack_a(target.surfels.slack[j]),
        slack_b(source.slack[i]),
        b(T.linear() * source.normals[i].cast<double>()) {}
};

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// Geman and McClure's kernel.
double kernel_weight(double e2, double kernel) {
  const double root_weight = kernel * kernel / (kernel * kernel + e2);
  return root_weight * root_weight;
}

inline void add_by_weight(NormalEquations& sum, const Pair& pair, const Eigen::Vector3d& centre,
                          const SurfelMatchOptions& options) {
  const Eigen::Matrix3d M = weight_of(options.method, pair.a, pair.slack_a, pair.b, pair.slack_b);
  const double weight =
      kernel_weight(squared_residual(options.method, M, pair.d, pair.slack_a + pair.slack_b), options.kernel);
  const Eigen::Vector3d r = pair.p - centre, Md = weight * M * pair.d;
  const Eigen::Matrix3d rx = cross_matrix(r), Mr = -weight * M * rx;
  sum.H.topLeftCorner<3, 3>() += weight * M;
  sum.H.topRightCorner<3, 3>() += Mr;
  sum.H.bottomRightCorner<3, 3>() += rx * Mr;
  sum.b.head<3>() += Md;
  sum.b.tail<3>() += r.cross(Md);
  sum.pairs += 1;
}

/// The same for point-to-plane, whose matrix has a single direction.
inline void add_along_normal(NormalEquations& sum, const Pair& pair, const Eigen::Vector3d& centre,
                             const SurfelMatchOptions& options) {
  sum.pairs += 1;
  if (pair.slack_a >= kFlatEnough) return;
  const double e = pair.a.dot(pair.d);
  Vector6d row;
  row << pair.a, (pair.p - centre).cross(pair.a);
  const Vector6d weighed = kernel_weight(e * e, options.kernel) * row;
  for (int k = 0; k < 6; ++k) sum.H.col(k).head(k + 1) += row[k] * weighed.head(k + 1);
  sum.b += e * weighed;
}

}  // namespace

NormalEquations& NormalEquations::operator+=(const NormalEquations& other) {
  H += other.H;
  b += other.b;
  pairs += other.pairs;
  return *this;
}

void find_partners(PartnerSearch& search, const Surfels& source, const Eigen::Isometry3d& T_target_source,
                   int threads) {
  search.move_to(T_target_source);
  for_each_chunk(source.count(), kChunk, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) search.update(i);
  });
}

std::vector<double> residuals(const SurfelTarget& target, const Surfels& source,
                              const PartnerSearch& partners, const Eigen::Isometry3d& T_target_source,
                              int threads) {
  constexpr IcpMethod method = IcpMethod::generalised;
  std::vector<double> result(source.count(), -1);
  for_each_chunk(source.count(), kChunk, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (partners.partner(i) < 0) continue;
      const Pair pair(target, static_cast<std::size_t>(partners.partner(i)), source, i, T_target_source);
      const Eigen::Matrix3d M = weight_of(method, pair.a, pair.slack_a, pair.b, pair.slack_b);
      result[i] = std::sqrt(squared_residual(method, M, pair.d, pair.slack_a + pair.slack_b));
    }
  });
  return result;
}

NormalEquations match(const SurfelTarget& target, const Surfels& source,
                      const Eigen::Isometry3d& T_target_source, const Eigen::Vector3d& centre,
                      const SurfelMatchOptions& options, PartnerSearch& search) {
  search.move_to(T_target_source);
  const bool along_normal = options.method == IcpMethod::point_to_plane;
  NormalEquations sum = sum_over_chunks<NormalEquations>(
      source.count(), kChunk, options.threads, [&](std::size_t begin, std::size_t end) {
        NormalEquations part;
        for (std::size_t i = begin; i < end; ++i) {
          search.update(i);
          if (search.partner(i) < 0) continue;
          const Pair pair(target, static_cast<std::size_t>(search.partner(i)), source, i, T_target_source);
          along_normal ? add_along_normal(part, pair, centre, options)
                       : add_by_weight(part, pair, centre, options);
        }
        return part;
      });
  sum.H.triangularView<Eigen::StrictlyLower>() = sum.H.transpose();
  return sum;
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

}  // namespace parhelion::cloud

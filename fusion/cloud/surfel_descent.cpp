#include "fusion/cloud/surfel_descent.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

#include "protocols/quantile.hpp"

namespace parhelion::cloud {
namespace {

/// The kernel's width fitted to the residuals of these clouds: 3 sigma, from their median; at least half a
/// surfel, below which the surfel's own shape dominates.
double fitted_kernel(const Level& level, const PartnerSearch& partners, const Eigen::Isometry3d& T) {
  std::vector<double> found = residuals(level.target, level.source, partners, T, level.options.threads);
  std::erase_if(found, [](double e) { return e < 0; });
  if (found.empty()) return level.options.kernel;
  return std::clamp(3 * 1.4826 * median(found), level.source.size / 2, level.source.size);
}

}  // namespace

Pyramid pyramid(VoxelMoments finest, int threads) {
  Pyramid result{finest.surfels(threads)};
  VoxelMoments& moments = finest;
  for (int i = 1; i < kSurfelResolutions; ++i) {
    moments = moments.coarser();
    result.push_back(moments.surfels(threads));
  }
  return result;
}

std::vector<SurfelTarget> targets(const Pyramid& surfels) { return {surfels.begin(), surfels.end()}; }

/// Coarser levels search in a wider radius: each level's gate covers the remaining error of the previous one.
std::vector<Level> make_levels(const std::vector<SurfelTarget>& target, const Pyramid& source,
                               const RegistrationOptions& options) {
  constexpr std::array<double, kSurfelResolutions> gates{2.5, 2, 1.5, 1.25};  // of the surfels' size
  const IcpMethod method = options.method == IcpMethod::paper ? IcpMethod::point_to_point : options.method;
  std::vector<Level> levels;
  for (std::size_t i = 0; i < kSurfelResolutions; ++i) {
    const double size = source[i].size;
    const double gate = std::min(gates[i] * size, std::max(options.max_distance, 3 * source[0].size));
    levels.push_back({target[i], source[i], {method, gate, size / 2, options.threads}});
  }
  return levels;
}

namespace {

/// Iterates in one level until convergence or until its part of the iterations is used up.
void settle(const Level& level, bool finest, int max_iterations, int max_per_level, Descent& result) {
  // A coarser level only has to come within the reach of the next.
  const double small = level.source.size / (finest ? 200 : 50);
  bool fitted = !finest;
  result.settled = false;
  result.options = level.options;
  for (int i = 0; i < max_per_level && result.iterations < max_iterations; ++i) {
    if (!fitted && (result.settled || i == max_per_level / 2)) {
      find_partners(result.partners, level.source, result.T, level.options.threads);
      result.options.kernel = fitted_kernel(level, result.partners, result.T);
      fitted = true;
    }
    const Eigen::Vector3d centre = result.T.translation();
    const NormalEquations equations =
        match(level.target, level.source, result.T, centre, result.options, result.partners);
    if (equations.pairs < 6) return;
    Matrix6d H = equations.H;
    H.diagonal().array() += 1e-6 * H.trace() / 6;  // no motion along undetermined directions
    // Partners that alternate would make it oscillate: shorter steps prevent that.
    const double shorter = i < 8 ? 1 : i < 16 ? 0.5 : 0.2;
    const Vector6d step = shorter * H.ldlt().solve(equations.b);
    if (!step.allFinite()) return;
    result.T = stepped(result.T, step, centre);
    ++result.iterations;
    result.last_step = step.head<3>().norm();
    result.settled = step.head<3>().norm() < small && step.tail<3>().norm() < small / 3;
    if (result.settled && fitted) return;
  }
}

}  // namespace

Descent descend(std::span<const Level> levels, const Eigen::Isometry3d& guess, int max_iterations,
                int max_per_level) {
  Descent result{guess, levels[0].options, {levels[0].target, levels[0].source, levels[0].options.gate}};
  for (std::size_t l = levels.size(); l-- > 0;) {
    result.partners = PartnerSearch(levels[l].target, levels[l].source, levels[l].options.gate);
    settle(levels[l], l == 0, max_iterations, max_per_level, result);
  }
  find_partners(result.partners, levels[0].source, result.T, levels[0].options.threads);
  return result;
}

double agreement(const Level& level, const PartnerSearch& partners, const Eigen::Isometry3d& T) {
  const std::vector<double> found = residuals(level.target, level.source, partners, T, level.options.threads);
  const auto on =
      std::count_if(found.begin(), found.end(), [&](double e) { return e >= 0 && e < level.options.kernel; });
  return static_cast<double>(on) / static_cast<double>(found.size());
}

}  // namespace parhelion::cloud

// Rises of one flight are equal as built, and treads are level. Where a cloud bends, treads incline in it,
// and the inclination indicates the uncertainty of a tread's height: depth cameras distort distant points by
// centimetres.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "fusion/semantic/net/find_stairs.hpp"
#include "fusion/semantic/net/flight_strip.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kBuilt = 0.005;     // m, one sigma of a rise as built (DIN 18065: 5 mm)
constexpr double kSharp = 0.001;     // m, minimum sigma of a tread's height
constexpr double kUnknown = 0.02;    // m, sigma of a tread with too few points
constexpr double kBand = 0.06;       // m, around a tread's height
constexpr std::size_t kEnough = 15;  // points
constexpr double kOutlier = 2.5,
                 kMinBand = 0.008;  // medians, m: points farther from its line are ignored

/// Line of height over distance along the flight.
struct Profile {
  double length = 0;  ///< m, along the flight
  double slope = 0;   ///< m/m
  bool known = false;
};

Profile profile_of(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < kEnough) return {};
  std::vector<bool> used(points.size(), true);
  Profile profile;
  for (int round = 0; round < 5; ++round) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    double n = 0, ss = 0, sz = 0, low = 1e9, high = -1e9;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!used[i]) continue;
      mean += points[i];
      n += 1;
      low = std::min(low, points[i].x()), high = std::max(high, points[i].x());
    }
    mean /= n;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!used[i]) continue;
      const Eigen::Vector2d d = points[i] - mean;
      ss += d.x() * d.x();
      sz += d.x() * d.y();
    }
    if (ss <= 0) return {};
    profile = {high - low, sz / ss, true};
    std::vector<double> off;
    for (const Eigen::Vector2d& p : points)
      off.push_back(std::abs(p.y() - mean.y() - profile.slope * (p.x() - mean.x())));
    const double band = std::max(kMinBand, kOutlier * median(std::vector<double>(off)));
    for (std::size_t i = 0; i < off.size(); ++i) used[i] = off[i] < band;
  }
  return profile;
}

}  // namespace

void even_rises(const StripPoints& points, Flight& flight) {
  const std::size_t n = flight.steps.size();
  if (n < 4) return;
  const std::vector<std::vector<Eigen::Vector2d>> treads = points_on_steps(points, flight, kBand);
  // Least squares over all heights and the common rise: each height is measured, and each rise is close to
  // the common one.
  const auto size = static_cast<Eigen::Index>(n) + 1;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (Eigen::Index i = 0; i < size - 1; ++i) {
    const Profile profile = profile_of(treads[static_cast<std::size_t>(i)]);
    // Heights along an inclined line are uniformly distributed: variance is a twelfth of the range squared.
    const double spread = profile.slope * profile.length / std::sqrt(12.0);
    const double sigma = profile.known ? std::hypot(kSharp, spread) : kUnknown;
    normal(i, i) += 1 / (sigma * sigma);
    right(i) += flight.steps[static_cast<std::size_t>(i)].z / (sigma * sigma);
    if (i == 0) continue;
    Eigen::VectorXd rise = Eigen::VectorXd::Zero(size);
    rise(i) = 1, rise(i - 1) = -1, rise(size - 1) = -1;
    normal += rise * rise.transpose() / (kBuilt * kBuilt);
  }
  const Eigen::VectorXd heights = normal.ldlt().solve(right);
  if (!heights.allFinite()) return;
  for (std::size_t i = 0; i < n; ++i) flight.steps[i].z = heights(static_cast<Eigen::Index>(i));
}

}  // namespace parhelion::semantic

#include "fusion/scan/unexplained.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fusion/scan/lidar_model.hpp"

namespace parhelion::scan {

std::span<const UnexplainedDisc> UnexplainedReturns::find(const Scan& real, const LaserDescription& laser,
                                                          const LaserMotion& motion,
                                                          std::span<const float> time,
                                                          std::span<const RangeHit> building_hits,
                                                          double sigma) {
  discs_.clear();
  cluster_.clear();
  const std::size_t beams = std::min({real.ranges.size(), time.size(), building_hits.size()});
  discs_.reserve(beams);
  cluster_.reserve(beams);
  if (beams == 0 || !motion.T_map_laser_start.finite() || !motion.T_map_laser_end.finite()) return discs_;
  rays_.set(motion, beam_set(real, time.first(beams)));

  // Returns in front of the model and apart from its surfaces.
  const double doubt = options_.sigmas * std::hypot(sigma, laser.noise_sigma);
  unexplained_.assign(beams, 0);
  for (std::size_t i = 0; i < beams; ++i) {
    const double range = real.ranges[i];
    if (laser.convention.classify(real.ranges[i]) != BeamKind::hit) continue;
    if (!(range < building_hits[i].range - (options_.margin + doubt))) continue;
    // A laser that points down, on a ramp, sees the floor, which need not be in the model.
    const double height = (rays_.origin(i) + range * rays_.direction(i)).z();
    if (rays_.direction(i).z() < -1e-6 && height < options_.floor_margin + options_.floor_slope * range)
      continue;
    unexplained_[i] =
        clear_of_model(i, range, building_hits, options_.clearance + doubt, real.angle_increment);
  }

  // Neighbouring returns close to each other form one obstacle. A full turn starts at a gap, so that no
  // obstacle is cut.
  const double step = std::abs(double{real.angle_increment});
  std::size_t start = 0;
  if (step * static_cast<double>(beams + 1) >= 2 * std::numbers::pi) {
    start = static_cast<std::size_t>(std::find(unexplained_.begin(), unexplained_.end(), 0) -
                                     unexplained_.begin());
  }
  for (std::size_t k = 0; k < beams; ++k) {
    const std::size_t i = (start + k) % beams;
    if (unexplained_[i] == 0) continue;
    const double range = real.ranges[i];
    const Eigen::Vector2d p = (rays_.origin(i) + range * rays_.direction(i)).head<2>();
    const double gap = std::max(options_.gap, 3 * step * range);
    const bool apart = !cluster_.empty() && ((p - cluster_.back()).norm() > gap ||
                                             (p - cluster_.front()).norm() > options_.max_diameter);
    if (apart) close_cluster();
    cluster_.push_back(p);
  }
  close_cluster();
  return discs_;
}

bool UnexplainedReturns::clear_of_model(std::size_t i, double range, std::span<const RangeHit> building_hits,
                                        double clearance, double angle_increment) const {
  // Modelled surfaces nearer than the clearance lie within asin(clearance / range) of the beam's bearing.
  const std::size_t beams = unexplained_.size();
  const double angle = clearance < range ? std::asin(clearance / range) : std::numbers::pi;
  const double width = std::ceil(angle / std::max(std::abs(angle_increment), 1e-9));
  const std::size_t reach = width < static_cast<double>(beams) ? static_cast<std::size_t>(width) : beams;
  const Eigen::Vector3d p = rays_.origin(i) + range * rays_.direction(i);
  const std::size_t first = i > reach ? i - reach : 0, last = std::min(i + reach + 1, beams);
  for (std::size_t j = first; j < last; ++j) {
    const double wall = building_hits[j].range;
    if (std::abs(wall - range) > clearance) continue;
    if ((rays_.origin(j) + wall * rays_.direction(j) - p).norm() <= clearance) return false;
  }
  return true;
}

void UnexplainedReturns::close_cluster() {
  if (cluster_.size() >= options_.min_returns) {
    // Centred between the two returns farthest from each other, estimated from the ends of the arc.
    Eigen::Vector2d low = cluster_.front(), high = low;
    for (const Eigen::Vector2d& p : cluster_) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    UnexplainedDisc disc{(low + high) / 2, options_.min_radius, cluster_.size()};
    for (const Eigen::Vector2d& p : cluster_) disc.radius = std::max(disc.radius, (p - disc.center).norm());
    discs_.push_back(disc);
  }
  cluster_.clear();
}

}  // namespace parhelion::scan

#include "fusion/people/segments.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fusion/people/segment_shape.hpp"
#include "fusion/scan/lidar_model.hpp"

namespace parhelion::people {
namespace {

constexpr double kOccluder = 0.15;      // m nearer than a segment's end: what hides the rest of it
constexpr double kNeighbourhood = 1.5;  // m
constexpr int kMaxPassed = 4;           // beams

float& feature(SegmentFeatures& features, SegmentFeature which) {
  return features[static_cast<std::size_t>(which)];
}

/// Range beside the segment's end minus the range there, -1..1; `step`: 1 or -1 beam. Beams without a valid
/// measurement are passed over: what many drivers write for "no return" is such a value.
double step_beside(const LaserSweep& sweep, std::int64_t beam, double range, std::int64_t step) {
  const auto beams = static_cast<std::int64_t>(sweep.scan.ranges.size());
  const double turn = std::abs(double{sweep.scan.angle_increment}) * static_cast<double>(beams + 1);
  for (int passed = 0; passed < kMaxPassed; ++passed, beam += step) {
    if (turn >= 2 * std::numbers::pi) beam = (beam + beams) % beams;
    if (beam < 0 || beam >= beams) return passed == 0 ? -1 : 1;  // outside the field of view: hidden
    const float beside = sweep.scan.ranges[static_cast<std::size_t>(beam)];
    const BeamKind kind = sweep.description.convention.classify(beside);
    if (kind == BeamKind::hit) return std::clamp(double{beside} - range, -1.0, 1.0);
    if (kind == BeamKind::no_return) return 1;
  }
  return 1;
}

}  // namespace

std::span<const Segment> SegmentedScan::find(const LaserSweep& sweep) {
  segments_.clear();
  returns_.clear();
  wide_.clear();
  const std::size_t beams = std::min(sweep.scan.ranges.size(), sweep.beam_time.size());
  segments_.reserve(beams);
  returns_.reserve(beams);
  wide_.reserve(2 * beams);
  centers_.reserve(beams);
  if (beams == 0 || !sweep.motion.T_map_laser_start.finite() || !sweep.motion.T_map_laser_end.finite())
    return segments_;
  rays_.set(sweep.motion, scan::beam_set(sweep.scan, sweep.beam_time.first(beams)));
  collect_returns(sweep);
  split(sweep);
  add_neighbours();
  return segments_;
}

void SegmentedScan::collect_returns(const LaserSweep& sweep) {
  const double margin =
      options_.margin + options_.sigmas * std::hypot(sweep.sigma, sweep.description.noise_sigma);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    const double range = sweep.scan.ranges[i];
    if (sweep.description.convention.classify(sweep.scan.ranges[i]) != BeamKind::hit) continue;
    const Eigen::Vector3d p = rays_.origin(i) + range * rays_.direction(i);
    // A laser that points down sees the floor, which need not be in the model.
    if (rays_.direction(i).z() < -1e-6 && p.z() < options_.floor_margin + 0.01 * range) continue;
    if (building(sweep, i, range, margin)) continue;
    returns_.push_back({p.head<2>(), range, static_cast<std::uint32_t>(i)});
  }
  // A full turn starts at a gap, so that no segment is cut.
  const double step = std::abs(double{sweep.scan.angle_increment});
  if (step * static_cast<double>(rays_.size() + 1) < 2 * std::numbers::pi) return;
  for (std::size_t k = 1; k < returns_.size(); ++k) {
    if ((returns_[k].p - returns_[k - 1].p).norm() <= options_.max_gap) continue;
    std::rotate(returns_.begin(), returns_.begin() + static_cast<std::ptrdiff_t>(k), returns_.end());
    return;
  }
}

/// `margin`: m, of what is the building although nearer.
bool SegmentedScan::building(const LaserSweep& sweep, std::size_t beam, double range, double margin) const {
  const std::size_t modelled = std::min(sweep.building.size(), rays_.size());
  if (beam >= modelled) return false;
  if (range >= sweep.building[beam].range - margin) return true;
  // Modelled surfaces nearer than the margin lie within asin(margin / range) of the beam's bearing.
  const double angle = margin < range ? std::asin(margin / range) : std::numbers::pi;
  const double step = std::max(std::abs(double{sweep.scan.angle_increment}), 1e-9);
  const auto reach = static_cast<std::size_t>(std::min(std::ceil(angle / step), 60.0));
  const Eigen::Vector3d p = rays_.origin(beam) + range * rays_.direction(beam);
  for (std::size_t j = beam > reach ? beam - reach : 0; j < std::min(beam + reach + 1, modelled); ++j) {
    const double wall = sweep.building[j].range;
    if (std::abs(wall - range) > margin) continue;
    if ((rays_.origin(j) + wall * rays_.direction(j) - p).norm() <= margin) return true;
  }
  return false;
}

void SegmentedScan::split(const LaserSweep& sweep) {
  const double step = std::abs(double{sweep.scan.angle_increment});
  std::size_t first = 0;
  for (std::size_t k = 1; k <= returns_.size(); ++k) {
    if (k < returns_.size()) {
      const Return &a = returns_[k - 1], &b = returns_[k];
      const double gap =
          std::clamp(options_.gap_beams * step * std::min(a.range, b.range), options_.gap, options_.max_gap);
      if ((a.p - b.p).norm() <= gap) continue;
    }
    close(sweep, first, k - 1);
    first = k;
  }
}

void SegmentedScan::close(const LaserSweep& sweep, std::size_t first, std::size_t last) {
  const std::span<const Return> part = std::span(returns_).subspan(first, last - first + 1);
  const double width = (part.front().p - part.back().p).norm();
  const Eigen::Vector2d eye = rays_.origin(part[part.size() / 2].beam).head<2>();
  const SegmentShape shape = shape_of(part, eye);
  if (width > options_.max_width || shape.radius > options_.max_width) {
    wide_.push_back(part.front().p);
    wide_.push_back(part.back().p);
    return;
  }
  if (part.size() < options_.min_returns) return;
  Segment segment;
  segment.first = static_cast<std::uint32_t>(first);
  segment.last = static_cast<std::uint32_t>(last);
  segment.center = shape.center;
  segment.width = width;
  segment.radius = shape.radius;
  segment.range = (shape.center - eye).norm();
  const double before = step_beside(sweep, std::int64_t{part.front().beam} - 1, part.front().range, -1);
  const double after = step_beside(sweep, std::int64_t{part.back().beam} + 1, part.back().range, 1);
  segment.occluded = before < -kOccluder || after < -kOccluder;
  using F = SegmentFeature;
  const auto set = [&](F which, double value) {
    feature(segment.features, which) = static_cast<float>(value);
  };
  set(F::returns, std::min(static_cast<double>(part.size()), 60.0));
  set(F::width, width);
  set(F::depth, shape.depth);
  set(F::concavity, shape.concavity);
  set(F::roughness, shape.roughness);
  set(F::circle_radius, shape.circle_radius);
  set(F::circle_residual, shape.circle_residual);
  set(F::range, segment.range);
  set(F::spacing, segment.range * std::abs(double{sweep.scan.angle_increment}));
  set(F::nearer_step, std::min(before, after));  // the same for both directions of a sweep
  set(F::farther_step, std::max(before, after));
  set(F::laser_height, rays_.origin(part.front().beam).z());
  segments_.push_back(segment);
}

void SegmentedScan::add_neighbours() {
  centers_.clear();
  for (const Segment& segment : segments_) centers_.add(segment.center);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    Segment& segment = segments_[i];
    double nearest = kNeighbourhood, second = kNeighbourhood, width = 0, straight = 1;
    int within = 0;
    centers_.each(segment.center, kNeighbourhood, [&](std::size_t j) {
      const double squared = (segments_[j].center - segment.center).squaredNorm();
      if (i == j || squared >= kNeighbourhood * kNeighbourhood) return true;
      const double distance = std::sqrt(squared);
      within += distance < 1 ? 1 : 0;
      second = std::min(second, std::max(distance, nearest));
      if (distance < nearest) {
        nearest = distance;
        width = segments_[j].width;
      }
      return true;
    });
    for (const Eigen::Vector2d& end : wide_)
      straight = std::min(straight, (end - segment.center).squaredNorm());
    straight = std::sqrt(straight);
    using F = SegmentFeature;
    feature(segment.features, F::nearest_distance) = static_cast<float>(nearest);
    feature(segment.features, F::nearest_width) = static_cast<float>(width);
    feature(segment.features, F::second_distance) = static_cast<float>(second);
    feature(segment.features, F::neighbours) = static_cast<float>(std::min(within, 10));
    feature(segment.features, F::straight_distance) = static_cast<float>(straight);
  }
}

}  // namespace parhelion::people

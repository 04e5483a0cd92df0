#include "fusion/scan/leaf_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fusion/scan/beam_window.hpp"
#include "fusion/scan/lidar_model.hpp"

namespace parhelion::scan {
namespace {

constexpr double kTau = 2 * std::numbers::pi;
constexpr double kSlack = 0.05;     // rad, tolerance of a leaf's limits
constexpr double kUpright = 0.999;  // cosine
constexpr int kRefinements = 3;
constexpr int kCandidates = 3;
constexpr double kGrazing = 0.1;  // minimum sine of the angle between beam and leaf

double within_turn(double angle) {
  const double turned = std::fmod(angle, kTau);
  return turned < 0 ? turned + kTau : turned;
}

/// The shortest rotation from b to a.
double between(double a, double b) { return std::remainder(a - b, kTau); }

}  // namespace

std::vector<WallBeside> walls_beside(const ModelEntity& door, const Hinge& hinge,
                                     const SemanticModel& model) {
  std::vector<WallBeside> walls;
  const Eigen::Vector3d axis = door.T_map_body * Eigen::Vector3d(hinge.axis.x(), hinge.axis.y(), 0);
  const Eigen::Vector3d closed = leaf_at(door, hinge, hinge.closed).translation();
  const double reach = std::hypot(leaf_reach(door, hinge), door.size.z() / 2);
  for (const ModelEntity& entity : model.entities) {
    const bool wall = entity.label == EntityLabel::wall || entity.label == EntityLabel::pillar ||
                      entity.label == EntityLabel::window;
    if (!wall || !is_solid(entity) || entity.is_virtual || !entity.T_map_body.finite()) continue;
    const WallBeside beside{entity.T_map_body.inverse(), entity.size / 2};
    const auto outside = [&](const Eigen::Vector3d& p) {
      return ((beside.T_wall_map * p).cwiseAbs() - beside.half).cwiseMax(0).norm();
    };
    // An entity drawn across the opening is ignored.
    if (outside(axis) <= reach && outside(closed) > 0) walls.push_back(beside);
  }
  return walls;
}

bool LeafFit::on_wall(const Eigen::Vector3d& p_map, std::span<const WallBeside> walls) const {
  return std::any_of(walls.begin(), walls.end(), [&](const WallBeside& wall) {
    return (((wall.T_wall_map * p_map).cwiseAbs() - wall.half).array() <= options_.in_wall).all();
  });
}

void LeafFit::set_scan(const Scan& real, const LaserDescription& laser, const LaserMotion& motion,
                       std::span<const float> time, double sigma) {
  real_ = &real;
  laser_ = &laser;
  const std::size_t beams = std::min(real.ranges.size(), time.size());
  const bool usable =
      motion.T_map_laser_start.finite() && motion.T_map_laser_end.finite() && std::isfinite(sigma);
  beams_ = beam_set(real, time.first(usable ? beams : 0));
  if (!usable) return;
  rays_.set(motion, beams_);
  margin_ =
      std::min(options_.max_margin, options_.margin + options_.sigmas * std::hypot(sigma, laser.noise_sigma));
}

/// The beams that come near the hinge, in the drawn leaf's plane.
void LeafFit::gather(const Transform<Map, Body>& T_map_leaf, const Eigen::Vector2d& axis, const Leaf& leaf,
                     std::span<const WallBeside> walls) {
  near_.clear();
  const Eigen::Matrix3d R = T_map_leaf.rotation();
  const Eigen::Vector3d at = T_map_leaf * Eigen::Vector3d(axis.x(), axis.y(), 0);
  const double range_max = laser_->convention.range_max;
  const BeamWindow window(beams_, rays_.half_turn(), rays_.half_tilt(), range_max);
  const Eigen::Vector3d eye = (rays_.start() + rays_.end()) / 2;
  const double moves = (rays_.end() - rays_.start()).norm() / 2;
  const Eigen::Vector3d center = rays_.R_map_middle().transpose() * (at - eye);
  const double reach = std::hypot(leaf.length(), leaf.half_height) + moves;
  if (center.norm() - reach > range_max) return;
  for (const BeamRange& beams : window.meet(center, reach)) {
    for (std::size_t i = beams.first; i < beams.last; ++i) {
      const BeamKind kind = laser_->convention.classify(real_->ranges[i]);
      if (kind == BeamKind::invalid || kind == BeamKind::too_close) continue;
      const Eigen::Vector3d origin = R.transpose() * (rays_.origin(i) - at);
      const Eigen::Vector3d direction = R.transpose() * rays_.direction(i);
      const Eigen::Vector2d o = origin.head<2>(), d = direction.head<2>();
      // Beams farther from the axis than the leaf's length cannot meet it at any angle.
      if (std::abs(o.x() * d.y() - o.y() * d.x()) > leaf.length() * d.norm()) continue;
      const double range =
          kind == BeamKind::hit ? double{real_->ranges[i]} : std::numeric_limits<double>::infinity();
      const bool of_wall =
          kind == BeamKind::hit && on_wall(rays_.origin(i) + range * rays_.direction(i), walls);
      near_.push_back({o, d, range, origin.z(), direction.z(), of_wall});
    }
  }
}

/// Votes of returns in the ring swept by the leaf, per degree.
void LeafFit::vote(const Leaf& leaf) {
  votes_.fill(0);
  const double sense = leaf.x1 >= -leaf.x0 ? 0 : std::numbers::pi;
  for (const Beam& beam : near_) {
    if (!std::isfinite(beam.range) || beam.of_wall) continue;
    const Eigen::Vector2d p = beam.origin + beam.range * beam.direction;
    const double r = p.norm();
    if (r < options_.jamb || r > leaf.length() + margin_) continue;
    if (std::abs(beam.origin_z + beam.range * beam.direction_z) > leaf.half_height) continue;
    // The direction of the leaf's middle line if this point lies on the face towards the laser.
    const double side = p.x() * beam.origin.y() - p.y() * beam.origin.x() > 0 ? 1 : -1;
    const double off = std::asin(std::clamp(side * leaf.half_thickness / r, -1.0, 1.0));
    const double angle = within_turn(std::atan2(p.y(), p.x()) - off - sense);
    ++votes_[std::min<std::size_t>(359, static_cast<std::size_t>(angle * 360 / kTau))];
  }
}

LeafFit::Judged LeafFit::judge(const Leaf& leaf, double angle, double margin) const {
  Judged judged;
  const double c = std::cos(angle), s = std::sin(angle);
  for (const Beam& beam : near_) {
    const Eigen::Vector2d o(c * beam.origin.x() + s * beam.origin.y(),
                            c * beam.origin.y() - s * beam.origin.x());
    const Eigen::Vector2d d(c * beam.direction.x() + s * beam.direction.y(),
                            c * beam.direction.y() - s * beam.direction.x());
    if (std::abs(o.y() - leaf.y) <= leaf.half_thickness || std::abs(d.y()) < kGrazing) continue;
    const double face = leaf.y + std::copysign(leaf.half_thickness, o.y() - leaf.y);
    const double t = (face - o.y()) / d.y();
    const double x = o.x() + t * d.x();
    if (t <= 0 || x < leaf.x0 || x > leaf.x1 || std::abs(x) < options_.jamb) continue;
    if (std::abs(beam.origin_z + t * beam.direction_z) > leaf.half_height) continue;
    const double offset = (beam.range - t) * d.y();  // m across the leaf
    if (std::abs(offset) > margin) {
      if (beam.range > t) ++judged.through;
      continue;
    }
    if (beam.of_wall) continue;
    const double arm = o.x() + beam.range * d.x();
    judged.first = judged.on == 0 ? arm : std::min(judged.first, arm);
    judged.last = judged.on == 0 ? arm : std::max(judged.last, arm);
    ++judged.on;
    judged.moment += arm * offset;
    judged.moment_squared += arm * arm;
  }
  return judged;
}

/// Least squares around a vote; none where the returns fit no leaf.
std::optional<double> LeafFit::refine(const Leaf& leaf, double angle, Judged& judged) const {
  // A vote covers a whole degree: the first fit includes the resulting offset at the leaf's end.
  double margin = margin_ + leaf.length() * kTau / 360;
  for (int i = 0; i < kRefinements; ++i) {
    judged = judge(leaf, angle, margin);
    if (judged.on < options_.min_returns) return std::nullopt;
    angle += std::clamp(judged.moment / judged.moment_squared, -0.05, 0.05);
    margin = margin_;
  }
  judged = judge(leaf, angle, margin_);
  const auto on = static_cast<double>(judged.on);
  const bool enough = judged.on >= options_.min_returns &&
                      on >= options_.min_fraction * (on + static_cast<double>(judged.through)) &&
                      judged.last - judged.first >= options_.min_extent * leaf.length();
  const double middle = (leaf.lower + leaf.upper) / 2, half = (leaf.upper - leaf.lower) / 2;
  const double off = between(angle, middle);
  if (!enough || std::abs(off) > half + kSlack) return std::nullopt;
  return middle + std::clamp(off, -half, half);
}

LeafFitResult LeafFit::find(const ModelEntity& door, const Hinge& hinge, std::optional<double> known,
                            std::span<const WallBeside> walls) {
  LeafFitResult sight;
  const Eigen::Vector3d& size = door.size;
  if (beams_.time.empty() || door.T_map_body.rotation()(2, 2) < kUpright) return sight;
  const Leaf leaf{-size.x() / 2 - hinge.axis.x(),
                  size.x() / 2 - hinge.axis.x(),
                  -hinge.axis.y(),
                  size.y() / 2,
                  size.z() / 2,
                  hinge.lower,
                  hinge.upper};
  gather(door.T_map_body, hinge.axis, leaf, walls);
  if (near_.size() < options_.min_returns) return sight;
  if (known) {
    const Judged there = judge(leaf, *known, margin_);
    sight.gone = there.through >= options_.min_returns && there.through > 2 * there.on;
  }
  vote(leaf);
  std::size_t best = 0;
  for (int candidate = 0; candidate < kCandidates; ++candidate) {
    const auto top = std::max_element(votes_.begin(), votes_.end());
    if (*top == 0) break;
    const auto degree = static_cast<std::size_t>(top - votes_.begin());
    for (std::size_t i = 0; i < 7; ++i) votes_[(degree + 360 + i - 3) % 360] = 0;
    Judged judged;
    const auto angle = refine(leaf, (static_cast<double>(degree) + 0.5) * kTau / 360, judged);
    if (!angle) continue;
    if (sight.angle && std::abs(*angle - *sight.angle) > options_.apart) {
      // Two fits: a wall beside the door looks like a leaf. The last known angle resolves the ambiguity.
      const bool first = known && std::abs(*sight.angle - *known) < options_.apart;
      const bool second = known && std::abs(*angle - *known) < options_.apart;
      if (first == second) return {std::nullopt, sight.gone, 0};
      if (first) continue;
      best = 0;
    }
    if (judged.on <= best) continue;
    best = judged.on;
    sight.angle = angle;
  }
  sight.returns = best;
  return sight;
}

}  // namespace parhelion::scan

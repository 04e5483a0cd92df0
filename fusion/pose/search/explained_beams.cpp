#include "fusion/pose/search/explained_beams.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace parhelion::pose {
namespace {

/// Evidence of a beam for a place, in tenths. A beam that ends in space that the map knows to be free is
/// none: something is new there.
constexpr std::int8_t kExplained = 10, kUnknown = 6, kThrough = -10;
/// The same of a beam that ends in unknown space, for a place that is to be ruled out.
constexpr int kPossible = 9;

/// Whether a mapped surface lies across the beam, well before its end.
bool passes_through(const FrozenMap& map, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  constexpr double first = 0.3, last = 0.5, grazing = 0.4;  // m, m, sine of an angle
  const double range = (to - from).norm(), step = map.likelihood.resolution();
  const Eigen::Vector2d d = (to - from) / std::max(range, 1e-6);
  for (double s = first; s < range - last; s += step) {
    const Eigen::Vector2d p = from + s * d;
    if (!map.likelihood.has_point(p)) continue;
    const Surfel* surfel = map.fine.nearest(p);
    if (surfel != nullptr && surfel->flat && std::abs(surfel->normal.dot(d)) > grazing) return true;
  }
  return false;
}

bool is_explained(const SurfelMap& map, const Eigen::Vector2d& p_map) {
  constexpr double inlier = 0.1;  // m
  const Surfel* surfel = map.nearest(p_map);
  if (surfel == nullptr) return false;
  const Eigen::Vector2d offset = p_map - surfel->mean;
  return (surfel->flat ? std::abs(surfel->normal.dot(offset)) : offset.norm()) < inlier;
}

}  // namespace

void ExplainedBeams::assign(const FrozenMap& map, std::span<const SeenBeam> beams, const Pose2& T_map_base) {
  beams_.assign(beams.size(), 0);
  std::size_t explained = 0, through = 0;
  int sum = 0;
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const Eigen::Vector2d end = T_map_base * beams[i].to;
    if (is_explained(map.fine, end)) {
      ++explained;
      beams_[i] = kExplained;
    } else if (passes_through(map, T_map_base * beams[i].from, end)) {
      ++through;
      beams_[i] = kThrough;
    } else if (!map.known.contains(end)) {
      beams_[i] = kUnknown;
    }
    sum += beams_[i];
  }
  const double count = static_cast<double>(std::max<std::size_t>(beams.size(), 1));
  explained_ = static_cast<double>(explained) / count;
  through_ = static_cast<double>(through) / count;
  evidence_ = sum / (kExplained * count);
}

ExplainedBeams::Comparison ExplainedBeams::against(const ExplainedBeams& other) const {
  int won = 0, lost = 0;
  const std::size_t count = std::min(beams_.size(), other.beams_.size());
  for (std::size_t i = 0; i < count; ++i) {
    const int lead = beams_[i] - (other.beams_[i] == kUnknown ? kPossible : other.beams_[i]);
    (lead > 0 ? won : lost) += std::abs(lead);
  }
  const double all = kExplained * static_cast<double>(std::max<std::size_t>(count, 1));
  return {won / all, lost / all};
}

}  // namespace parhelion::pose

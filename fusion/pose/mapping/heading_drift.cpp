#include "fusion/pose/mapping/heading_drift.hpp"

#include <algorithm>

namespace parhelion::pose {
namespace {

constexpr double kLength = 4;        ///< m of path that is looked at together
constexpr int kFewestKeyframes = 4;  ///< whose walls say the same
/// How much larger the drift of the heading is than the keyframes' covariance says, 1 sigma. Real lasers have
/// errors that are alike from scan to scan. Chosen on Intel, with fewer beams, noise and steps of the range,
/// and on generated houses whose walls are not parallel.
constexpr double kOfExpected = 1.5;
constexpr double kImpossible = 3;  ///< sigma, of a turn: another direction of walls

}  // namespace

double HeadingDrift::length_since(const std::vector<Keyframe>& keyframes) const {
  return keyframes.back().driven - keyframes[learned_ == 0 ? 0 : learned_ - 1].driven;
}

/// Mean over the second half of the path.
std::optional<double> HeadingDrift::turned(const std::vector<Keyframe>& keyframes) const {
  double sum = 0;
  int count = 0;
  for (std::size_t k = keyframes.size(); k-- > learned_;) {
    if (keyframes.back().driven - keyframes[k].driven >= kLength / 2) break;
    const auto turned = directions_.turned(keyframes[k].walls, keyframes[k].T_map_base.yaw);
    if (turned) sum += *turned, ++count;
  }
  return count < kFewestKeyframes ? std::nullopt : std::optional(sum / count);
}

std::optional<HeadingDrift::Correction> HeadingDrift::check(const std::vector<Keyframe>& keyframes) {
  if (learned_ == 0 || length_since(keyframes) < kLength) return std::nullopt;
  const double expected = keyframes.back().drift(2, 2) - keyframes[learned_ - 1].drift(2, 2);
  variance_ += kOfExpected * kOfExpected * std::max(expected, 0.0);
  const auto turned = this->turned(keyframes);
  const double innovation = variance_ + directions_.variance();
  if (!turned || *turned * *turned > kImpossible * kImpossible * innovation) return std::nullopt;
  const double gain = variance_ / innovation;
  variance_ *= 1 - gain;
  return Correction{learned_, -gain * *turned};
}

void HeadingDrift::learn(const std::vector<Keyframe>& keyframes) {
  if (learned_ != 0 && length_since(keyframes) < kLength) return;
  for (std::size_t k = learned_; k < keyframes.size(); ++k)
    directions_.add(keyframes[k].walls, keyframes[k].T_map_base.yaw);
  learned_ = keyframes.size();
}

void HeadingDrift::restart(const std::vector<Keyframe>& keyframes) {
  *this = {};
  learn(keyframes);
}

void bend(std::vector<Keyframe>& keyframes, const HeadingDrift::Correction& correction) {
  const double begin = keyframes[correction.first - 1].driven, length = keyframes.back().driven - begin;
  for (std::size_t k = correction.first; k < keyframes.size(); ++k) {
    const double part = (keyframes[k].driven - keyframes[k - 1].driven) / length;
    keyframes[k].step = keyframes[k].step * Pose2{0, 0, part * correction.turn};
    keyframes[k].T_map_base = keyframes[k - 1].T_map_base * keyframes[k].step;
  }
}

}  // namespace parhelion::pose

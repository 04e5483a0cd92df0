// The drift of the heading while mapping, taken out of the path by the directions of walls before a loop
// shows it.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "fusion/pose/mapping/keyframe.hpp"
#include "fusion/pose/mapping/wall_directions.hpp"

namespace parhelion::pose {

class HeadingDrift {
 public:
  /// Bend the path from keyframe `first` on, evenly along its length, so that its end turns by `turn`, rad.
  struct Correction {
    std::size_t first = 0;
    double turn = 0;
  };
  /// Checks the path since the last check, once it is long enough. nullopt: walls show no drift. Apply the
  /// correction to the keyframes before the next call.
  std::optional<Correction> check(const std::vector<Keyframe>& keyframes);
  /// Adds the walls of the keyframes since the last call, at their current poses.
  void learn(const std::vector<Keyframe>& keyframes);
  /// All poses were corrected by a loop.
  void restart(const std::vector<Keyframe>& keyframes);

 private:
  double length_since(const std::vector<Keyframe>& keyframes) const;
  std::optional<double> turned(const std::vector<Keyframe>& keyframes) const;

  WallDirections directions_;
  std::size_t learned_ = 0;  ///< keyframes
  double variance_ = 0;      ///< rad^2, of the heading there
};

/// Changes the steps and poses of the keyframes from `correction.first` on.
void bend(std::vector<Keyframe>& keyframes, const HeadingDrift::Correction& correction);

}  // namespace parhelion::pose

// Evidence for and against a pose: beams that end on mapped surfaces, and beams that pass through them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/search/recent_scans.hpp"

namespace parhelion::pose {

/// How well a map explains beams from a pose.
class ExplainedBeams {
 public:
  void assign(const FrozenMap& map, std::span<const SeenBeam> beams, const Pose2& T_map_base);

  double explained() const { return explained_; }  ///< fraction that ends on a mapped surface
  double through() const { return through_; }      ///< fraction that passes through one, and ends elsewhere
  /// 1: all beams end on mapped surfaces, -1: all pass through one.
  double evidence() const { return evidence_; }
  /// Fractions of the beams that this pose explains better than `other` does, and the other way round.
  struct Comparison {
    double won = 0, lost = 0;
  };
  Comparison against(const ExplainedBeams& other) const;

 private:
  std::vector<std::int8_t> beams_;  ///< evidence, in tenths
  double explained_ = 0, through_ = 0, evidence_ = 0;
};

}  // namespace parhelion::pose

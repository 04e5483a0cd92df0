// Global localization: where the map has several similar places, each candidate is followed until the others
// score clearly worse.
#pragma once

#include <optional>
#include <vector>

#include "fusion/pose/frozen_map.hpp"
#include "fusion/pose/scan_match.hpp"
#include "fusion/pose/scan_points.hpp"

namespace parhelion::pose {

class GlobalSearch {
 public:
  /// The pose, once a single candidate is left; nullopt before.
  std::optional<Pose2> add(const FrozenMap& map, const ScanPoints& scan, const Pose2& step);
  void restart() { hypotheses_.clear(); }

 private:
  struct Hypothesis {
    Pose2 T_map_base;
    double evidence = 0;  ///< sum over the scans of the fraction of explained points and of the likelihood
  };
  void seed(const FrozenMap& map, const ScanPoints& scan);
  void follow(const FrozenMap& map, const ScanPoints& scan, const Pose2& step);
  void merge();

  std::vector<Hypothesis> hypotheses_;
  int scans_ = 0;  ///< since the seed
  double driven_ = 0, turn_ = 0;
};

}  // namespace parhelion::pose

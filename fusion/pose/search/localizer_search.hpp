// Global localization: the whole map is searched again and again, a bounded part of it at each scan. Every
// place found is followed until one explains what was seen on the last metres, and no other nearly as well.
#pragma once

#include <optional>
#include <vector>

#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/search/correlative_search.hpp"
#include "fusion/pose/search/explained_beams.hpp"
#include "fusion/pose/search/recent_scans.hpp"

namespace parhelion::pose {

/// Where odometry predicts a robot that was localized before.
struct Vicinity {
  Pose2 T_map_base;
  double reach = 0, yaw_reach = 0;  ///< m, rad: 3 sigma
  bool contains(const Pose2& T_map_base) const;
};

class GlobalSearch {
 public:
  /// Squares of the map's search: per second between scans, and at one scan.
  static constexpr double kEvaluationsPerSecond = 400'000;
  static constexpr std::size_t kMaxEvaluations = 80'000;

  /// `step`: of the base since the previous scan, by odometry. The pose, once no other place is possible, or
  /// once none has explained more for a while than one where the robot is expected; nullopt before.
  std::optional<Pose2> add(const FrozenMap& map, const ScanPoints& scan, const Pose2& step,
                           const std::optional<Vicinity>& expected = std::nullopt);
  /// `usual`: fraction of the beams that the map has usually explained. A grid holds less than what scans
  /// see.
  void restart(double usual = 1);

  std::size_t evaluations() const { return search_.evaluations(); }

 private:
  struct Hypothesis {
    Pose2 T_map_base;
    ExplainedBeams beams;
    int scans = 0;      ///< since it was found
    double driven = 0;  ///< m, the same
  };
  void begin(const FrozenMap& map);
  void search(const FrozenMap& map, std::size_t evaluations);
  void follow(const FrozenMap& map);
  void refine(const FrozenMap& map, const Pose2& start);
  void propose(const FrozenMap& map, const Pose2& T_map_base);
  void look_near(const FrozenMap& map, const Vicinity& expected);
  void merge();
  void follow_leader();
  bool is_decided(const FrozenMap& map) const;
  bool leads_where_expected(const Vicinity& expected) const;

  double min_explained_ = 0.7;  ///< fraction of the beams, by the place that is accepted
  RecentScans recent_;
  std::optional<SensorTime> before_;     ///< stamp of the previous scan
  std::vector<Eigen::Vector2d> points_;  ///< ends of some recent beams; m, base_link
  CorrelativeSearch search_;
  Pose2 T_begin_now_;  ///< the robot's motion since the scan at which the search began
  std::size_t refined_ = 0;
  bool searching_ = false, before_leader_ = false;  ///< a search, that began before the leader led
  std::optional<Pose2> leader_;                     ///< the most evident place, now
  int searches_ = 0;                                ///< whole ones, since it is the most evident one
  double unlisted_ = 1;  ///< no place that is not followed had a higher score in the last search
  std::vector<Hypothesis> hypotheses_;  ///< most evident first
};

}  // namespace parhelion::pose

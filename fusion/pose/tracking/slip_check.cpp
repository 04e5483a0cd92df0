#include "fusion/pose/tracking/slip_check.hpp"

#include <algorithm>

#include "fusion/pose/search/wide_search.hpp"

namespace parhelion::pose {
namespace {

/// Of what the map explains usually: a scan is poor below the first, and another place must explain the
/// second, and so much more of the points. Chosen on fr-clinic.
constexpr double kPoor = 0.8, kNearlyUsual = 0.88, kMore = 0.2;
constexpr int kPoorScans = 3, kGoodScans = 3;
constexpr double kReach = 4, kYawReach = 0.25;  ///< m, rad: how far a robot has slipped at most
constexpr double kMinScore = 0.4;               ///< of the correlative search
constexpr Duration kSearchedEvery = seconds(2.0);

}  // namespace

bool SlipCheck::add(const FrozenMap& map, const ScanPoints& scan, const Pose2& T_map_base, double explained,
                    double usual, const MatchOptions& options) {
  const bool poor = explained < kPoor * usual;
  poor_ = poor ? poor_ + 1 : 0;
  good_ = poor ? 0 : good_ + 1;
  if (slipped_) return slipped_ = good_ < kGoodScans;
  if (poor_ < kPoorScans || (searched_ && scan.stamp - *searched_ < kSearchedEvery)) return false;
  searched_ = scan.stamp;
  WideSearchOptions wide{kReach, kYawReach, kMinScore};
  wide.min_explained = wide.good = std::max(kNearlyUsual * usual, explained + kMore);
  wide.lead = wide.lead_of_good = 0;
  slipped_ = wide_search(map.likelihood, map.fine, scan.points, T_map_base, wide, options).has_value();
  return slipped_;
}

}  // namespace parhelion::pose

// How high a site's floor and ceiling are, and how sharply that can be said: scans bend, so that a height to
// a centimetre is one of a place.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/frames.hpp"
#include "protocols/status.hpp"

namespace parhelion::semantic {

/// The points of one level.
struct LevelHeights {
  double low = 0, median = 0, high = 0;  ///< m: 5, 50, 95 percent of its points
  double lean = 0;                       ///< rad, of the plane through them against level
};

/// What was measured near one scanner, where the angles of its beams matter least.
struct ScannerHeights {
  double z = 0;                          ///< m, of the scanner
  std::optional<double> floor, ceiling;  ///< m, medians of the points within 1.5 m of it in the plan
};

struct SiteHeights {
  std::optional<LevelHeights> floor, ceiling;
  std::vector<ScannerHeights> scanners;  ///< one for each viewpoint
};

/// Of points that are labelled floor within 0.25 m of `floor`, and ceiling of `ceiling` (m, map frame;
/// nullopt where there is none).
SiteHeights site_heights(const cloud::PointCloud<Map>& cloud, std::optional<double> floor,
                         std::optional<double> ceiling);

/// "floor -1.258 m (nine tenths of its points from -1.288 to -1.237), ...": one line for a person.
std::string in_words(const SiteHeights& heights);

/// A picture, heights.png in `folder`: how many points lie at each centimetre around the floor and the
/// ceiling, as the first scan has them and level. Nothing where neither is there. Errors: a folder that
/// cannot be written.
Status write_heights(const cloud::PointCloud<Map>& cloud, const Transform<Map, Cloud>& T_map_cloud,
                     const SiteHeights& heights, const std::string& folder);

}  // namespace parhelion::semantic

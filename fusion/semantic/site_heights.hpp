// Heights of a site's floor and ceiling, and their accuracy: scans bend, so a height accurate to a centimetre
// holds only locally.
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
  double low = 0, median = 0, high = 0;  ///< m: 5th, 50th, 95th percentile of its points
  double lean = 0;                       ///< rad, angle between the plane through them and level
};

/// Heights near one scanner, where angular errors of its beams matter least.
struct ScannerHeights {
  double z = 0;                          ///< m, of the scanner
  std::optional<double> floor, ceiling;  ///< m, medians of the points within a horizontal distance of 1.5 m
};

struct SiteHeights {
  std::optional<LevelHeights> floor, ceiling;
  std::vector<ScannerHeights> scanners;  ///< one for each viewpoint
};

/// Uses points labelled floor within 0.25 m of `floor`, and points labelled ceiling likewise (m, map frame;
/// nullopt where there is none).
SiteHeights site_heights(const cloud::PointCloud<Map>& cloud, std::optional<double> floor,
                         std::optional<double> ceiling);

/// "floor -1.258 m (nine tenths of its points from -1.288 to -1.237), ...": one readable line.
std::string heights_text(const SiteHeights& heights);

/// A picture, heights.png in `folder`: the number of points at each centimetre around the floor and the
/// ceiling, in the first scan's orientation and levelled. Writes nothing where neither exists. Errors: a
/// folder that cannot be written.
Status write_heights(const cloud::PointCloud<Map>& cloud, const Transform<Map, Cloud>& T_map_cloud,
                     const SiteHeights& heights, const std::string& folder);

}  // namespace parhelion::semantic

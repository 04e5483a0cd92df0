// What a server needs of a map to match scans to it: the surfels, as bytes that a session log can hold.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fusion/pose/matching/surfel_map.hpp"
#include "protocols/status.hpp"

namespace parhelion::pose {

struct MatchingMap {
  std::string id;  ///< as PoseEstimate::map_id
  SurfelMap fine{0.1}, coarse{0.4};
  double sigma = 0.01;               ///< m, accuracy of its surfaces
  std::vector<std::uint8_t> packed;  ///< what it was unpacked from
};

/// The map that SLAM localizes in: .simplemap or ROS map YAML, packed.
Result<std::vector<std::uint8_t>> pack_matching_map(const std::string& path);
/// Numbers are rounded to 32 bits, so a server uses the unpacked map, as its replay does. Errors begin with
/// `origin`.
Result<MatchingMap> unpack_matching_map(std::span<const std::uint8_t> bytes, const std::string& origin);

}  // namespace parhelion::pose

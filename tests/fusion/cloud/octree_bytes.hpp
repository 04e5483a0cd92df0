// Small binary octrees as OctoMap writes them.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace parhelion::test::octree {

inline const std::string kHead =
    "# Octomap OcTree binary file\n# (feel free to add / change comments)\nid OcTree\nsize 17\nres "
    "0.1\ndata\n";

/// Bits of a node as octomap writes them: of child c the two from 2 c; occupied is "01", inner "11".
inline std::string node(const std::vector<std::pair<int, int>>& children) {
  unsigned bits = 0;
  for (const auto& [child, kind] : children) bits |= static_cast<unsigned>(kind) << (2 * child);
  return {static_cast<char>(bits & 255), static_cast<char>(bits >> 8)};
}
constexpr int kFree = 1, kOccupied = 2, kInner = 3;  ///< of a child

/// One path down to the smallest cubes at the corner of the origin, in the direction of child `octant`.
inline std::string tree(int octant, const std::string& last) {
  std::string bytes = kHead;
  bytes += node({{octant, kInner}});
  for (int depth = 1; depth < 15; ++depth) bytes += node({{7 - octant, kInner}});
  return bytes + last;
}

}  // namespace parhelion::test::octree

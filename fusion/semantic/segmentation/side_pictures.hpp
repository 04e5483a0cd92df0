// A tile's pictures from the side, and the level lines in them. Internal to find_horizontals.cpp.
#pragma once

#include <array>
#include <vector>

#include "fusion/semantic/segmentation/surface_search.hpp"

namespace parhelion::semantic {

/// Per block column or row of a tile and its margins: heights (m) of level lines.
using HeightsByBlock = std::array<std::vector<double>, kTileBlocks + 2>;

struct LevelLines {
  HeightsByBlock along_x, along_y;  ///< in OXZ by block column, in OYZ by block row
};

LevelLines level_lines(const Site& site, Tile tile, StageImages* stages);

}  // namespace parhelion::semantic

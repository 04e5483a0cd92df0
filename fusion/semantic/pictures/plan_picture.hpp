// A top view: grid map, walls of the model, driven paths, agents, one augmented scan.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/model.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"

namespace parhelion::semantic {

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;
};

/// A line in the map frame; a ring marks its start, an arrow its end. A body of the same entity has the same
/// colour.
struct PlanPath {
  std::string label;  ///< in the legend
  Colour colour{31, 111, 235};
  std::vector<Eigen::Vector2d> points;  ///< m, map frame
  std::string entity = {};              ///< owner of the path; empty: none
};

/// One scan in the map frame.
struct PlanScan {
  Eigen::Vector2d laser = Eigen::Vector2d::Zero();  ///< m, position of the laser
  std::vector<Eigen::Vector2d> real;                ///< m, real returns
  std::vector<Eigen::Vector2d> injected;            ///< m, virtual returns
};

/// Content of a picture; each part may be absent, but at least one must have an extent.
struct PlanPicture {
  std::string title;  ///< ASCII; other characters are drawn as '?'
  std::string subtitle;
  const pose::GridMap* map = nullptr;
  const SemanticModel* model = nullptr;
  std::vector<PlanPath> paths;
  const WorldSnapshot* world = nullptr;  ///< bodies of agents and of the real robot, without the building
  std::optional<PlanScan> scan;
  double focus = 0;  ///< m: shows only this far around paths, bodies and the scan; 0: everything
  int width = 1600;  ///< pixels; the height follows from the content
};

/// The points of an augmented scan taken from T_map_base. `beam_agent`: per beam an index >= 0 where the
/// return is virtual (as in ScanInfo and augment_scan); empty: all are real. Beams without a return are
/// ignored.
PlanScan plan_scan(const Scan& scan, const LaserDescription& laser, std::span<const std::int16_t> beam_agent,
                   const Transform<Map, Base>& T_map_base);

/// Writes a PNG. Errors: nothing to draw, coordinates that are not finite, a path that cannot be written.
Status draw_plan(const PlanPicture& picture, const std::string& path);

}  // namespace parhelion::semantic

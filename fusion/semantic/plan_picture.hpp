// A picture from above for people: grid map, walls of the model, driven paths, agents, one augmented scan.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fusion/pose/slam.hpp"
#include "protocols/model.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"

namespace parhelion::semantic {

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;
};

/// A line in the map frame; its start gets a ring, its end an arrow. A body of the same entity is drawn in
/// the same colour.
struct PlanPath {
  std::string label;  ///< in the legend
  Colour colour{31, 111, 235};
  std::vector<Eigen::Vector2d> points;  ///< m, map frame
  std::string entity = {};              ///< whose path it is; empty: nobody's
};

/// One scan in the map frame.
struct PlanScan {
  Eigen::Vector2d laser = Eigen::Vector2d::Zero();  ///< m, where it stood
  std::vector<Eigen::Vector2d> real;                ///< m, real returns
  std::vector<Eigen::Vector2d> injected;            ///< m, virtual returns
};

/// What is to be drawn; each part may be absent, but something with an extent must be there.
struct PlanPicture {
  std::string title;  ///< ASCII; other characters are drawn as '?'
  std::string subtitle;
  const pose::GridMap* map = nullptr;
  const SemanticModel* model = nullptr;
  std::vector<PlanPath> paths;
  const WorldSnapshot* world = nullptr;  ///< bodies of agents and of the real robot; of the building none
  std::optional<PlanScan> scan;
  double focus = 0;  ///< m: shows only this far around paths, bodies and the scan's place; 0: everything
  int width = 1600;  ///< pixels; the height follows from what is drawn
};

/// The points of an augmented scan taken from T_map_base. `beam_agent`: per beam an index >= 0 where the
/// return is virtual (as in ScanInfo and augment_scan); empty: all are real. Beams without a return are left
/// out.
PlanScan plan_scan(const Scan& scan, const LaserDescription& laser, std::span<const std::int16_t> beam_agent,
                   const Transform<Map, Base>& T_map_base);

/// Writes a PNG. Errors: nothing to draw, coordinates that are not finite, a path that cannot be written.
Status draw_plan(const PlanPicture& picture, const std::string& path);

}  // namespace parhelion::semantic

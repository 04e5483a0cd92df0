// The plan of the building that a session's map shows.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "protocols/model.hpp"

namespace parhelion::review {

struct PlanPart {
  std::string name;
  EntityLabel label = EntityLabel::unknown;
  std::array<Eigen::Vector2d, 4> corners;  ///< m, map frame
};

/// A row of occupied cells: kPlanCell high, from `left` to `right` (m, map frame) about y.
struct PlanRow {
  double y, left, right;
};
inline constexpr double kPlanCell = 0.1;  // m

struct Plan {
  std::vector<PlanPart> parts;  ///< floors first
  std::vector<PlanRow> rows;    ///< of meshes, from 5 cm to 2 m above z = 0
};

Plan plan_of(const SemanticModel& model);

}  // namespace parhelion::review

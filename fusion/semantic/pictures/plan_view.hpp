// Selects the part of a model that pictures show.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "protocols/model.hpp"

namespace parhelion::semantic {

struct MainPart {
  SemanticModel model;   ///< the floors, and entities within 3 m of them or of one another
  std::string left_out;  ///< text on how much lies farther out; empty: nothing
};

/// Leaves out distant parts, as a scanner's view through a door to the end of a street would make the rest
/// too small to read. Returns the whole model where less than half of its area is distant.
MainPart main_part(const SemanticModel& model);

/// Whether an entity is drawn in plans: not where it is above a person's head.
bool in_plan(const ModelEntity& entity);

/// The bounds of a model's plan with a margin (m, map frame); empty where there is nothing.
Eigen::AlignedBox2d plan_box(const SemanticModel& model);

}  // namespace parhelion::semantic

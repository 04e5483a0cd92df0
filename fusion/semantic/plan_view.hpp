// Which part of a model pictures show.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "protocols/model.hpp"

namespace parhelion::semantic {

struct MainPart {
  SemanticModel model;   ///< the floors, and what stands within 3 m of them or of one another
  std::string left_out;  ///< how much lies farther out, in words; empty: nothing
};

/// What a scanner saw through a door at the end of a street would make the rest too small to be read. The
/// whole model where less than half of its area lies out there.
MainPart main_part(const SemanticModel& model);

/// Whether an entity is drawn in plans: what is over a person's head is not.
bool in_plan(const ModelEntity& entity);

/// What a plan of a model shows, with a margin (m, map frame); empty where there is nothing.
Eigen::AlignedBox2d plan_box(const SemanticModel& model);

}  // namespace parhelion::semantic

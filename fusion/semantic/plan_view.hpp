// Which part of a model a plan shows. Internal to the pictures of models.
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "protocols/model.hpp"

namespace parhelion {

struct PlanView {
  Eigen::AlignedBox2d box;  ///< m, map frame, with a margin; empty where there is nothing
  std::string left_out;     ///< what lies beyond it, in words; empty: nothing
};

/// Whether an entity is drawn in plans: what is over a person's head is not.
bool in_plan(const ModelEntity& entity);

/// All of a model, or its main building where pieces far from it would make that small.
PlanView plan_view(const SemanticModel& model);

}  // namespace parhelion

// Positions of labels in a plan: beside the entity and without overlap. Internal to model_plan.cpp.
#pragma once

#include <string>
#include <vector>

#include "fusion/semantic/pictures/plan_canvas.hpp"
#include "fusion/semantic/pictures/plan_outline.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

class PlanLabels {
 public:
  explicit PlanLabels(PlanCanvas& canvas) : canvas_(canvas) {}

  /// Later labels avoid this outline where possible.
  void keep_clear(const Outline& outline);
  /// Writes beside the middle of a long side, else near its ends; false where every position is taken, or
  /// has more than `max_below` of the points to avoid: nothing is written.
  bool beside(const ModelEntity& entity, const std::string& words, double size, Colour colour,
              double max_below = 12);

 private:
  double cost(const Eigen::AlignedBox2d& box) const;

  PlanCanvas& canvas_;
  std::vector<Eigen::AlignedBox2d> label_boxes_;  ///< pixels
  std::vector<Eigen::Vector2d> drawn_;            ///< pixels, points that labels avoid
};

}  // namespace parhelion::semantic

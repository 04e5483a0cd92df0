#include "fusion/semantic/pictures/plan_labels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parhelion::semantic {
namespace {

constexpr double kGap = 6;  ///< pixels between an object and its label

}  // namespace

void PlanLabels::keep_clear(const Outline& outline) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d a = canvas_.pixel(outline[i]), b = canvas_.pixel(outline[(i + 1) % outline.size()]);
    const int steps = 1 + static_cast<int>(std::min(2000.0, (b - a).norm() / 6));
    for (int k = 0; k < steps; ++k) drawn_.push_back(a + (b - a) * k / steps);
  }
}

/// Infinite where there is a label already or outside of the plan; else the number of drawn points below.
double PlanLabels::cost(const Eigen::AlignedBox2d& box) const {
  constexpr double never = std::numeric_limits<double>::infinity();
  const Eigen::AlignedBox2d plan(Eigen::Vector2d(4, canvas_.title_bar() + 4),
                                 Eigen::Vector2d(canvas_.width() - 4, canvas_.plan_bottom() - 4));
  const Eigen::AlignedBox2d axes(Eigen::Vector2d(0, canvas_.plan_bottom() - 125),
                                 Eigen::Vector2d(135, canvas_.plan_bottom()));
  if (!plan.contains(box) || axes.intersects(box)) return never;
  if (std::any_of(label_boxes_.begin(), label_boxes_.end(),
                  [&](const auto& other) { return other.intersects(box); }))
    return never;
  return static_cast<double>(
      std::count_if(drawn_.begin(), drawn_.end(), [&](const auto& p) { return box.contains(p); }));
}

bool PlanLabels::beside(const ModelEntity& entity, const std::string& words, double size, Colour colour,
                        double max_below) {
  const double width = canvas_.text_width(words, size);
  const Eigen::Vector2d half(width / 2 + 2, size / 2 + 2);
  double best = std::numeric_limits<double>::infinity();
  Eigen::AlignedBox2d place;
  int rank = 0;
  for (const double along : {0.0, -0.25, 0.25, -0.4, 0.4}) {
    for (const double extra : {0.0, 16.0}) {
      for (const double side : {1.0, -1.0}) {
        const auto at = [&](double y) {
          return canvas_.pixel(
              (entity.T_map_body * Eigen::Vector3d(along * entity.size.x(), y, 0)).head<2>());
        };
        const Eigen::Vector2d edge = at(side * entity.size.y() / 2);
        const Eigen::Vector2d outward = (edge - at(0)).normalized();
        // Far enough out for the label's box to clear the side.
        const double reach =
            std::abs(outward.x()) * half.x() + std::abs(outward.y()) * half.y() + kGap + extra;
        const Eigen::Vector2d middle = edge + outward * reach;
        const Eigen::AlignedBox2d box(middle - half, middle + half);
        const double value = cost(box) + 0.15 * rank++;
        if (value < best) {
          best = value;
          place = box;
        }
      }
    }
  }
  if (!std::isfinite(best) || best > max_below) return false;
  label_boxes_.push_back(place);
  canvas_.text({place.min().x() + 2, place.center().y() + size / 2}, words, size, colour, true);
  return true;
}

}  // namespace parhelion::semantic

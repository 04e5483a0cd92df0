// The bar below a plan: scale and meaning of the colours. Internal to plan_picture.cpp.
#pragma once

#include <string>
#include <vector>

#include "fusion/semantic/pictures/plan_canvas.hpp"

namespace parhelion::semantic {

/// An entry that is shown only where the part that it explains is drawn.
struct LegendEntry {
  std::string label;
  Colour colour;
  enum class Mark { line, body, area, dot } mark;  ///< body: one with its path
};

class PlanLegend {
 public:
  static constexpr int kHeight = 96;  ///< pixels

  void add(LegendEntry entry) { entries_.push_back(std::move(entry)); }
  void paint(PlanCanvas& canvas) const;

 private:
  struct Place {
    double x = 0;  ///< pixels, left end
    int row = 0;
  };
  std::vector<Place> places(const PlanCanvas& canvas, double left, double size) const;
  static void paint_entry(PlanCanvas& canvas, const LegendEntry& entry, const Eigen::Vector2d& at,
                          double size);

  std::vector<LegendEntry> entries_;
};

}  // namespace parhelion::semantic

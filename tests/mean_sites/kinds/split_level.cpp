#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite split_level(SitePen& pen) {
  const double d = pen.range(4.5, 6), h = pen.range(2.5, 2.9), wide = 1.2;
  std::vector<double> level = {0, pen.range(0.3, 0.9), 0};
  level[2] = level[1] + pen.range(0.3, 0.7) * (pen.chance(0.5) ? 1 : -1);
  double x = 0;
  for (std::size_t r = 0; r < level.size(); ++r) {
    const double w = pen.range(3.8, 5), z = level[r];
    pen.box(EntityLabel::floor, {x - 0.1, -0.2, z - 0.3}, {x + w + 0.1, d + 0.2, z});
    pen.box(EntityLabel::ceiling, {x - 0.1, -0.2, z + h}, {x + w + 0.1, d + 0.2, z + h + 0.2});
    pen.wall({x, -0.06}, {x + w, -0.06}, z, z + h);
    pen.wall({x, d + 0.06}, {x + w, d + 0.06}, z, z + h);
    if (r == 0) pen.wall({-0.06, 0}, {-0.06, d}, z, z + h);
    const bool last = r + 1 == level.size();
    const double next = last ? z : level[r + 1], low = std::min(z, next), high = std::max(z, next);
    if (last) {
      pen.wall_with_door({x + w + 0.06, 0}, {x + w + 0.06, d}, z, z + h, 0.8, 0.9);
    } else {
      const double at = pen.range(0.6, d - 0.6 - wide);
      pen.wall({x + w, 0}, {x + w, at}, low, high + h);
      pen.wall({x + w, at + wide}, {x + w, d}, low, high + h);
      pen.wall({x + w, at}, {x + w, at + wide}, high + 2.1, high + h);
      pen.site().doors.push_back({{x + w, at + 0.5 * wide}, wide, high, Eigen::Vector2d::UnitY()});
      const int steps = std::max(1, static_cast<int>(std::lround((high - low) / 0.17)));
      if (steps > 1) {
        const bool rises = next > z;
        const double foot = rises ? x + w - 0.3 * (steps - 1) - 0.1 : x + w + 0.1 + 0.3 * (steps - 1);
        pen.flight({foot, at + 0.5 * wide, low}, rises ? 0 : 2, steps - 1, (high - low) / steps, 0.3, wide,
                   false);
      }
    }
    pen.table({x + 0.5 * w, d - 1.2, z}, 0, 1.4, 0.8, 0.74);
    pen.chair({x + 0.5 * w, d - 1.9, z}, 2);
    pen.solid("cupboard", {x + 0.5 * w, 0.3, z}, 0, {pen.range(0.8, 1.6), 0.5, pen.range(0.9, 2.0)});
    pen.stand({x + 0.4 * w, 0.5 * d, z + pen.range(1.2, 1.6)});
    x += w;
  }
  carry_camera(pen, 0.5, 0.5, 0.6 * x, d - 0.5, level[1]);
  return std::move(pen.site());
}

}  // namespace parhelion::test

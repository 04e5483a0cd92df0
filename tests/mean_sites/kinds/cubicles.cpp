#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite cubicles(SitePen& pen) {
  const double w = pen.range(9, 12), d = pen.range(7, 9), h = pen.range(2.5, 2.9),
               thin = pen.range(0.03, 0.05);
  draw_room(pen, w, d, h, 0.5 * d - 0.45);
  // Up to the ceiling: walls; others are things.
  const double y1 = 0.5 * d - 0.8, y2 = 0.5 * d + 0.8;
  for (double x = pen.range(2.4, 3); x < w - 1.5; x += pen.range(2.4, 3)) {
    if (pen.chance(0.6))
      pen.wall({x, 0}, {x, y1}, 0, h, thin);
    else
      pen.solid("thing", {x, 0.5 * y1, 0}, 1, {y1, thin, pen.range(1.2, 1.7)});
    pen.wall({x, y2}, {x, d}, 0, h, thin);
    pen.table({x - 1.0, 0.5, 0}, 0, 1.4, 0.7, 0.73);
    pen.chair({x - 1.0, 1.1, 0}, 0);
    if (pen.chance(0.6)) pen.solid("cupboard", {x + 0.4, d - 0.25, 0}, 0, {0.7, 0.4, pen.range(1.0, 2.0)});
  }
  for (double x = 0; x + 2.6 < w; x += 2.6) pen.wall_with_door({x, y2}, {x + 2.6, y2}, 0, h, 0.9, 0.8, thin);
  for (double x = 1.3; x < w; x += 2.6) {
    pen.stand({x, 0.5 * d, pen.range(1.3, 1.6)});
    if (pen.chance(0.5)) pen.stand({x + 0.2, y2 + 0.9, pen.range(1.3, 1.6)});
  }
  carry_camera(pen, 0.4, y1, w - 0.4, y2);
  return std::move(pen.site());
}

}  // namespace parhelion::test

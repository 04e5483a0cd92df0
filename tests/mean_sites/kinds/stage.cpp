#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite stage(SitePen& pen) {
  const double w = pen.range(11, 15), d = pen.range(7, 10), h = pen.range(3.6, 5), up = pen.range(0.5, 1.0),
               deep = pen.range(2.2, 3.8);
  draw_room(pen, w, d, h, pen.range(0.6, d - 2));
  const double edge = w - deep;
  pen.box(EntityLabel::floor, {edge, 0, 0}, {w, d, up});
  const int steps = static_cast<int>(std::lround(up / 0.17));
  pen.flight({edge - 0.3 * steps, pen.chance(0.5) ? 0.7 : d - 0.7, 0}, 0, steps, up / steps, 0.3, 1.2, false);
  for (double x = 2.5; x < edge - 2; x += 1.0) {
    for (double y = 1.6; y < d - 1.6; y += 0.6) {
      if (pen.chance(0.75)) pen.chair({x, y, 0}, 1);
    }
  }
  pen.solid("thing", {edge + 0.8, 0.5 * d, up}, 0, {0.5, 0.6, 1.15});  // a lectern
  pen.table({edge + 1.4, 0.5 * d + 1.5, up}, 1, 1.6, 0.7, 0.74);
  if (pen.chance(0.5)) pen.person({edge + 1.2, 0.5 * d - 1.2, up}, 1);
  pen.stand({1.4, 0.5 * d, pen.range(1.3, 1.7)});
  pen.stand({edge - 1.2, 0.45 * d, pen.range(1.3, 1.7)});
  if (pen.chance(0.5)) pen.stand({edge + 1.0, 0.7 * d, up + 1.4});
  carry_camera(pen, 3, 0.5, w - 0.5, d - 0.5);
  return std::move(pen.site());
}

}  // namespace parhelion::test

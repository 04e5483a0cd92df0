#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite rubble(SitePen& pen) {
  const double w = pen.range(7, 10), d = pen.range(6, 8), h = pen.range(2.6, 3.0);
  draw_room(pen, w, d, h, pen.range(0.4, 1.2));
  // A slab that fell: one edge on the floor, the other against the far wall.
  const double y0 = d - pen.range(1.8, 2.4), up = pen.range(1.0, 1.6);
  const std::size_t slab =
      draw_pitched(pen, EntityLabel::unknown, 0.5 * w, w - 0.5, {y0, 0.02}, {d - 0.05, up}, 0.15);
  pen.site().objects.push_back({"thing", {slab}});
  pen.thing("lying person", {0.45 * w, d - 0.6, 0}, 0,
            {{{-0.88, -0.18, 0}, {-0.03, -0.03, 0.14}},
             {{-0.88, 0.03, 0}, {-0.03, 0.18, 0.14}},
             {{-0.03, -0.24, 0}, {0.57, 0.24, 0.23}},
             {{0.61, -0.09, 0}, {0.87, 0.09, 0.22}}});
  for (int k = 0; k < 35; ++k) {
    const double x = w - std::abs(pen.range(-0.5, 0.5) + pen.range(-0.5, 0.5)) * w;
    pen.oddment({std::clamp(x, 1.5, w - 0.5), pen.range(0.5, d - 1.8), 0}, pen.range(0.2, 0.8));
  }
  pen.table({1.5, 0.7 * d, 0}, 1, 1.4, 0.7, 0.74);
  pen.stand({1.2, 0.45 * d, pen.range(1.2, 1.6)});
  pen.stand({0.5 * w, 0.5 * d, pen.range(1.2, 1.6)});
  carry_camera(pen, 0.4, 0.4, 0.8 * w, d - 0.4);
  return std::move(pen.site());
}

}  // namespace parhelion::test

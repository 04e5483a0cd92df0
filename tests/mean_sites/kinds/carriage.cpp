#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite carriage(SitePen& pen) {
  const double length = pen.range(10, 15), wide = pen.range(2.35, 2.8), h = pen.range(2.05, 2.35),
               sill = pen.range(0.85, 1.0), head = pen.range(1.65, 1.8), pitch = pen.range(0.75, 0.95);
  draw_slab(pen, -0.1, -0.1, length + 0.1, wide + 0.1, h);
  pen.wall({-0.03, 0}, {-0.03, wide}, 0, h, 0.06);
  pen.wall_with_door({length + 0.03, 0}, {length + 0.03, wide}, 0, h, 0.5 * wide - 0.4, 0.8, 0.06);
  for (const double y : {-0.03, wide + 0.03}) {
    const double from = y > 0 ? 0.0 : 1.4;
    if (y < 0) pen.wall_with_door({0, y}, {from, y}, 0, h, 0.3, 0.8, 0.06);
    pen.wall({from, y}, {length, y}, 0, sill, 0.06);
    pen.wall({from, y}, {length, y}, head, h, 0.06);
    for (double x = from; x < length - 1.4; x += 1.5) {
      pen.wall({x, y}, {x + 0.15, y}, sill, head, 0.06);
      pen.site().glass.push_back(pen.box(kNotJudged, {x + 0.15, y - 0.01, sill}, {x + 1.5, y + 0.01, head}));
    }
  }
  for (double x = 1.8; x < length - 1.2; x += pitch) {
    for (const double y : {0.24, 0.7, wide - 0.7, wide - 0.24}) {
      pen.thing("chair", {x, y, 0}, 0,
                {{{-0.22, -0.21, 0.38}, {0.22, 0.21, 0.48}},
                 {{0.16, -0.21, 0.48}, {0.24, 0.21, 1.15}},
                 {{-0.05, -0.05, 0}, {0.05, 0.05, 0.38}}});
    }
  }
  for (const double part : {0.06, 0.5, 0.94}) pen.stand({part * length, 0.5 * wide, pen.range(1.2, 1.6)});
  carry_camera(pen, 1, 0.3, length - 1, wide - 0.3);
  return std::move(pen.site());
}

}  // namespace parhelion::test

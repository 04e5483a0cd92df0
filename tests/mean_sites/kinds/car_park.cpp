#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

namespace {

void draw_car(SitePen& pen, double x, double y, int quarter) {
  const double body = pen.range(0.75, 0.95), roof = pen.range(1.4, 1.8), back = pen.range(2.9, 3.9);
  pen.thing("car", {x, y, 0}, quarter,
            {{{-2.1, -0.85, 0.25}, {2.1, 0.85, body}},
             {{back - 4.6, -0.78, body}, {back - 2.1, 0.78, roof}},
             {{-1.6, -0.85, 0}, {-1.0, 0.85, 0.3}},
             {{1.0, -0.85, 0}, {1.6, 0.85, 0.3}}});
}

}  // namespace

MeanSite car_park(SitePen& pen) {
  const double w = pen.range(16, 21), d = 15.5, h = pen.range(2.3, 2.8);
  draw_room(pen, w, d, h, pen.range(6.6, 7.8));
  for (double x = 2.7; x < w - 1; x += 5.2) {
    for (const double y : {5.2, d - 5.2})
      pen.box(EntityLabel::pillar, {x - 0.2, y - 0.2, 0}, {x + 0.2, y + 0.2, h});
    pen.box(EntityLabel::ceiling, {x - 0.15, 0, h - pen.range(0.2, 0.35)}, {x + 0.15, d, h});  // a beam
  }
  for (double x = 1.4; x < w - 1.2; x += 2.6) {
    if (pen.chance(0.6)) draw_car(pen, x, 2.5, 1);
    if (pen.chance(0.6)) draw_car(pen, x, d - 2.5, 3);
  }
  pen.solid("bin", {0.5, 0.5, 0}, 0, {0.5, 0.5, 0.9});
  for (const double part : {0.2, 0.5, 0.82})
    pen.stand({part * w, 0.5 * d + pen.range(-0.8, 0.8), pen.range(1.4, 1.7)});
  carry_camera(pen, 2, 4, w - 2, d - 4);
  return std::move(pen.site());
}

}  // namespace parhelion::test

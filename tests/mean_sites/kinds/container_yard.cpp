#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

namespace {

void draw_lorry(SitePen& pen, double x, double y) {
  const double length = pen.range(5, 8), floor = pen.range(0.9, 1.1), top = floor + pen.range(2.2, 2.6);
  std::vector<SitePen::Part> parts = {{{0, -1.25, floor}, {length, 1.25, top}},
                                      {{length + 0.3, -1.2, 0.5}, {length + 2.0, 1.2, pen.range(2.4, 2.9)}}};
  for (const double wheel : {0.8, length - 0.6, length + 0.9}) {
    parts.push_back({{wheel, -1.2, 0}, {wheel + 0.9, -0.9, 0.95}});
    parts.push_back({{wheel, 0.9, 0}, {wheel + 0.9, 1.2, 0.95}});
  }
  pen.thing("thing", {x, y, 0}, 0, parts);
}

}  // namespace

MeanSite container_yard(SitePen& pen) {
  const double w = pen.range(24, 30), d = pen.range(18, 22), h = pen.range(4.5, 6);
  draw_slab(pen, -1, -1, w + 1, d, 0);
  pen.wall({-1, d + 0.1}, {0.5 * w, d + 0.1}, 0, h, 0.2);
  pen.wall({0.5 * w + 1, d + 0.1}, {w + 1, d + 0.1}, 0, h, 0.2);
  pen.wall({0.5 * w, d + 0.1}, {0.5 * w + 1, d + 0.1}, 2.1, h, 0.2);
  pen.site().doors.push_back({{0.5 * w + 0.5, d + 0.1}, 1.0, 0, Eigen::Vector2d::UnitX()});
  constexpr double kWide = 2.44, kHigh = 2.6;
  for (const double y : {2.0, 8.0}) {
    for (double x = pen.range(0, 2); x + 6.1 < w; x += 6.1 + pen.range(0.6, 3)) {
      if (!pen.chance(0.75)) continue;
      const double length = pen.chance(0.3) ? 12.2 : 6.1, off = pen.range(-0.4, 0.4);
      if (x + length > w) break;
      pen.solid("thing", {x + 0.5 * length, y + off, 0}, 0,
                {length, kWide, pen.chance(0.3) ? 2 * kHigh : kHigh});
      x += length - 6.1;
    }
  }
  draw_lorry(pen, pen.range(2, 5), d - 5);
  if (pen.chance(0.6)) draw_lorry(pen, pen.range(14, 16), d - 5.5);
  pen.solid("box", {w - 2, d - 3, 0}, 0, {1.2, 0.8, 1.0});
  pen.stand({0.25 * w, 5.0, 1.6}), pen.stand({0.7 * w, 5.1, 1.6});
  pen.stand({0.45 * w, d - 8, 1.6}), pen.stand({0.85 * w, d - 2.5, 1.6});
  carry_camera(pen, 2, 10, w - 2, d - 1);
  return std::move(pen.site());
}

}  // namespace parhelion::test

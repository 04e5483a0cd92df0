#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

namespace {

/// Plates around a circle from `from` to `to` rad; returns their boxes.
std::vector<std::size_t> draw_round(SitePen& pen, EntityLabel label, const Eigen::Vector2d& centre,
                                    double radius, double from, double to, double z0, double z1) {
  const int plates = std::max(6, static_cast<int>(std::ceil((to - from) * radius / 0.35)));
  std::vector<std::size_t> boxes;
  for (int k = 0; k < plates; ++k) {
    const double a = from + (to - from) * (k + 0.5) / plates, along = radius * (to - from) / plates + 0.02;
    boxes.push_back(draw_turned(
        pen, label, {centre.x() + radius * std::cos(a), centre.y() + radius * std::sin(a), 0.5 * (z0 + z1)},
        a + EIGEN_PI / 2, {along, 0.04, z1 - z0}));
  }
  return boxes;
}

}  // namespace

MeanSite bulkheads(SitePen& pen) {
  const double w = pen.range(9, 12), d = pen.range(6, 8), h = pen.range(2.6, 3.4);
  draw_slab(pen, -0.2, -0.2, w + 0.6 * d, d + 0.2, h);
  pen.wall_with_door({-0.06, 0}, {-0.06, d}, 0, h, pen.range(0.5, d - 1.5), 0.9);
  pen.wall({-0.12, -0.06}, {w, -0.06}, 0, h);
  pen.wall({-0.12, d + 0.06}, {w, d + 0.06}, 0, h);
  draw_round(pen, EntityLabel::wall, {w, 0.5 * d}, 0.5 * d, -EIGEN_PI / 2, EIGEN_PI / 2, 0, h);
  for (int k = 0; k < 3; ++k) {
    const double radius = pen.range(0.4, 0.9), top = pen.range(1.4, h - 0.3);
    const Eigen::Vector2d at(2.2 + 2.6 * k, k == 1 ? 1.3 : d - 1.4);
    TrueObject tank{"thing", draw_round(pen, EntityLabel::unknown, at, radius, 0, 2 * EIGEN_PI, 0.05, top)};
    const double half = 0.7 * radius;
    tank.boxes.push_back(pen.box(EntityLabel::unknown, {at.x() - half, at.y() - half, top - 0.04},
                                 {at.x() + half, at.y() + half, top}));
    pen.site().objects.push_back(tank);
  }
  pen.thing("thing", {0, 0, 0}, 0, {{{0.3, 0.1, h - 0.4}, {w, 0.3, h - 0.2}}});  // a pipe
  pen.solid("box", {0.5 * w, 0.5 * d, 0}, 0, {0.6, 0.5, pen.range(0.5, 1.1)});
  pen.stand({1.3, 0.5 * d, pen.range(1.3, 1.6)}), pen.stand({0.6 * w, 0.5 * d + 1, pen.range(1.3, 1.6)});
  pen.stand({w, 0.5 * d, pen.range(1.3, 1.6)});
  carry_camera(pen, 0.5, 0.5, w + 1, d - 0.5);
  return std::move(pen.site());
}

}  // namespace parhelion::test

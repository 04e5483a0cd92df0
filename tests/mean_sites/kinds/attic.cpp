#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite attic(SitePen& pen) {
  const double w = pen.range(8, 11), d = pen.range(5, 7), knee = pen.range(0.7, 1.2),
               pitch = pen.range(0.6, 0.95), ridge = knee + 0.5 * d * std::tan(pitch);
  draw_slab(pen, -0.2, -0.2, w + 0.2, d + 0.2, 0);
  pen.site().ceiling = true;
  pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, 0, knee);
  pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, 0, knee);
  pen.wall_with_door({-0.06, 0}, {-0.06, d}, 0, ridge, 0.5 * d - 0.45, 0.9);
  pen.wall({w + 0.06, 0}, {w + 0.06, d}, 0, ridge);
  draw_pitched(pen, EntityLabel::ceiling, -0.2, w + 0.2, {0, knee}, {0.5 * d, ridge}, 0.15);
  draw_pitched(pen, EntityLabel::ceiling, -0.2, w + 0.2, {d, knee}, {0.5 * d, ridge}, 0.15);
  if (pen.chance(0.6)) pen.wall_with_door({0.55 * w, 0}, {0.55 * w, d}, 0, ridge, 0.5 * d - 0.4, 0.8);
  pen.bed({w - 1.4, 1.2, 0}, 2);
  pen.solid("cupboard", {1.2, 0.35, 0}, 0, {pen.range(0.8, 1.6), 0.5, 0.9 * knee});
  pen.table({2.4, 0.5 * d + 0.9, 0}, 0, 1.3, 0.7, 0.74);
  pen.chair({2.4, 0.5 * d + 0.3, 0}, 2);
  pen.solid("box", {0.7 * w, d - 0.6, 0}, 0, {0.5, 0.6, 0.4});
  pen.stand({0.25 * w, 0.5 * d, pen.range(1.2, 1.5)});
  pen.stand({0.75 * w, 0.5 * d + 0.3, pen.range(1.2, 1.5)});
  carry_camera(pen, 0.5, 0.5, w - 0.5, d - 0.5);
  return std::move(pen.site());
}

}  // namespace parhelion::test

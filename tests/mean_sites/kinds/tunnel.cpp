#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite tunnel(SitePen& pen) {
  const double length = pen.range(22, 32), wide = pen.range(4, 7), upright = pen.range(1.2, 2.2);
  draw_slab(pen, -0.2, -0.2, length + 0.2, wide + 0.2, 0);
  pen.site().ceiling = true;
  pen.wall({0, -0.1}, {length, -0.1}, 0, upright, 0.2);
  pen.wall({0, wide + 0.1}, {length, wide + 0.1}, 0, upright, 0.2);
  if (pen.chance(0.5)) pen.wall({length + 0.1, 0}, {length + 0.1, wide}, 0, upright + 0.5 * wide, 0.2);
  constexpr int kFacets = 8;
  const double radius = 0.5 * wide, flat = pen.range(0.6, 1.0);
  const auto at = [&](int k) {
    const double a = EIGEN_PI * k / kFacets;
    return Eigen::Vector2d(radius * (1 - std::cos(a)), upright + flat * radius * std::sin(a));
  };
  for (int k = 0; k < kFacets; ++k)
    draw_pitched(pen, EntityLabel::ceiling, -0.1, length + 0.1, at(k), at(k + 1), 0.1);
  const double walkway = pen.range(0.7, 1.0), up = pen.range(0.2, 0.4);
  pen.box(EntityLabel::floor, {0, wide - walkway, 0}, {length, wide, up});
  pen.solid("box", {0.4 * length, 0.8, 0}, 0, {0.8, 0.6, 0.7});
  pen.person({0.6 * length, 1.2, 0}, 0);
  for (const double part : {0.15, 0.5, 0.85}) pen.stand({part * length, 0.45 * wide, pen.range(1.4, 1.7)});
  carry_camera(pen, 0.2 * length, 0.4, 0.7 * length, wide - 1);
  return std::move(pen.site());
}

}  // namespace parhelion::test

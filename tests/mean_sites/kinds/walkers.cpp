#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite walkers(SitePen& pen) {
  const double w = pen.range(9, 13), d = pen.range(6, 9), h = pen.range(2.6, 3.4);
  draw_room(pen, w, d, h, pen.range(0.5, d - 1.5));
  for (int k = pen.whole(2, 4); k > 0; --k)
    pen.site().walkers.emplace_back(Eigen::Vector3d(pen.range(1, w - 1), pen.range(1, d - 1), 0),
                                    Eigen::Vector3d(pen.range(1, w - 1), pen.range(1, d - 1), 0));
  pen.table({0.5 * w, d - 0.6, 0}, 0, 1.6, 0.8, 0.74);
  pen.solid("cupboard", {w - 0.3, 0.5 * d, 0}, 1, {1.2, 0.5, pen.range(1.2, 2.0)});
  pen.sofa({0.4 * w, 0.5, 0}, 2, 1.8);
  for (int k = 0; k < 3; ++k) pen.chair({pen.range(2, w - 2), pen.range(1.5, d - 1.5), 0}, pen.whole(0, 3));
  pen.box(EntityLabel::pillar, {0.65 * w, 0.5 * d, 0}, {0.65 * w + 0.4, 0.5 * d + 0.4, h});
  pen.stand({0.25 * w, 0.4 * d, pen.range(1.3, 1.6)});
  pen.stand({0.8 * w, 0.6 * d, pen.range(1.3, 1.6)});
  carry_camera(pen, 0.5, 0.5, w - 0.5, d - 0.5);
  return std::move(pen.site());
}

}  // namespace parhelion::test

#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"
#include "tests/mean_sites/kinds/shell.hpp"

namespace parhelion::test {

MeanSite mirror_hall(SitePen& pen) {
  const double w = pen.range(7, 10), d = pen.range(5.5, 7.5), h = pen.range(2.6, 3.2);
  draw_room(pen, w, d, h, pen.range(0.5, d - 1.5));
  const double from = pen.range(1, 2), to = from + pen.range(2.5, 5), low = pen.range(0.15, 0.6);
  pen.site().mirrors.push_back(
      pen.box(kNotJudged, {from, d - 0.006, low}, {std::min(to, w - 0.6), d, low + pen.range(1.5, 2.0)}));
  for (int k = 0; k < 4; ++k) pen.chair({pen.range(1, w - 1), pen.range(1, d - 1.5), 0}, pen.whole(0, 3));
  pen.table({pen.range(2, w - 2), 0.6, 0}, 0, 1.4, 0.7, 0.74);
  pen.solid("cupboard", {w - 0.3, pen.range(1, d - 1), 0}, 1,
            {pen.range(0.8, 1.4), 0.5, pen.range(1.0, 2.0)});
  pen.plant({0.6, d - 0.6, 0});
  pen.stand({0.3 * w, 0.4 * d, pen.range(1.2, 1.6)});
  pen.stand({0.7 * w, 0.5 * d, pen.range(1.2, 1.6)});
  carry_camera(pen, 0.5, 0.5, w - 0.5, d - 0.5);
  return std::move(pen.site());
}

}  // namespace parhelion::test

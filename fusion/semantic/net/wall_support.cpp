#include "fusion/semantic/net/wall_support.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr double kFrom = 0.3, kTo = 2.1;  ///< m over the floor: below a lintel, over what lies on the floor
constexpr double kMeasured = 0.35;        ///< fraction of a column's rows
constexpr double kCrossed = 0.25, kInFront = 0.2;
constexpr int kSmooth = 2;                    ///< columns on either side
constexpr double kOpen = 0.35, kBlank = 0.6;  ///< m, of a gap: rays crossed it; nothing is known of it
constexpr double kHidden = 3.0;               ///< m, of a gap behind something
constexpr double kShortest = 0.3;             ///< m, measured, of a stretch

constexpr double kOver = 0.3;                  ///< m, of a wall over what hides it
constexpr double kTall = 1.2, kUpper = 0.6;    ///< m and fraction, of a wall that begins over a head
constexpr double kFront = 1.3, kPastIt = 0.5;  ///< m over the floor: a front's top; fraction of rays over it

enum class Support : std::uint8_t { measured, hidden, open };

Support support_between(const WallRaster& raster, int c0, int c1, double low, double high) {
  int rows = 0, measured = 0, crossed = 0, hidden = 0;
  for (int r = std::max(raster.row_of(low), 0); r < std::min(raster.row_of(high), raster.rows); ++r) {
    for (int c = std::max(c0, 0); c < std::min(c1, raster.columns); ++c) {
      const std::size_t i = raster.at(c, r);
      ++rows;
      if (raster.covered(c, r) || raster.behind[i] > 0)
        ++measured;
      else if (raster.through[i] > 0)
        ++crossed;
      else if (raster.hidden[i] > 0)
        ++hidden;
    }
  }
  if (rows == 0 || measured >= kMeasured * rows) return Support::measured;
  if (crossed >= kCrossed * rows) return Support::open;
  if (raster.viewpoints_known || hidden >= kInFront * rows) return Support::hidden;
  return Support::open;
}

/// A front of furniture: measured up to a low top, and rays pass over it, of a counter or a bed. Where a scan
/// has no ceiling, half of the height that it has seen may be such a front.
bool is_low_front(const WallRaster& raster, int c0, int c1, double floor, double high) {
  if (!raster.viewpoints_known) return false;
  c0 = std::max(c0, 0), c1 = std::min(c1, raster.columns);
  const int first = std::max(raster.row_of(floor + kFrom), 0),
            last = std::min(raster.row_of(high), raster.rows);
  const auto count = [&](int row, auto&& is) {
    int cells = 0;
    for (int c = c0; c < c1; ++c) cells += is(c, row) ? 1 : 0;
    return cells;
  };
  int top = first;
  for (int r = first; r < last; ++r)
    if (4 * count(r, [&](int c, int row) { return raster.measured[raster.at(c, row)] > 0; }) >= c1 - c0)
      top = r + 1;
  const bool low = top > first && raster.z_low + top * raster.row < floor + kFront;
  if (!low || (last - top) * raster.row < kOver) return false;
  int past = 0;
  for (int r = top; r < last; ++r)
    past += count(r, [&](int c, int row) { return raster.through[raster.at(c, row)] > 0; });
  return past >= kPastIt * (last - top) * (c1 - c0);
}

/// At the height of a body; behind furniture that of the wall over it, over a landing that of a tall wall.
Support support_of(const WallCandidate& wall, int c0, int c1) {
  const double high = wall.ceiling - 0.1, head = std::min(wall.floor + kTo, high);
  if (is_low_front(wall.raster, c0, c1, wall.floor, head)) return Support::open;
  const Support body = support_between(wall.raster, c0, c1, wall.floor + kFrom, head);
  const bool crossed = wall.raster.viewpoints_known && body == Support::open;
  const double min_height = body == Support::hidden ? kOver : kTall;
  if (body == Support::measured || crossed || high - head < min_height) return body;
  return wall.raster.fractions(c0, c1, head, high).measured > kUpper ? Support::measured : body;
}

class Stretches {
 public:
  explicit Stretches(const WallCandidate& wall) : wall_(wall) {
    for (int c = 0; c < wall.raster.columns; ++c)
      columns_.push_back(support_of(wall, c - kSmooth, c + kSmooth + 1));
  }
  void keep(const Opening& opening) {
    const double column = wall_.raster.column;
    for (int c = std::max(0, static_cast<int>(opening.from / column) - 1);
         c < std::min<int>(wall_.raster.columns, static_cast<int>(opening.to / column) + 2); ++c)
      columns_[static_cast<std::size_t>(c)] = Support::measured;
  }
  std::vector<WallStretch> find() const {
    const double column = wall_.raster.column;
    std::vector<WallStretch> found;
    int last = -1, open = 0, measured = 0, first = -1;
    const auto close = [&] {
      if (first >= 0 && measured * column >= kShortest)
        found.push_back({first * column, (last + 1) * column});
      first = -1, measured = 0;
    };
    for (int c = 0; c < static_cast<int>(columns_.size()); ++c) {
      const Support support = columns_[static_cast<std::size_t>(c)];
      if (support == Support::open) ++open;
      if (support != Support::measured) continue;
      const double widest = wall_.raster.viewpoints_known ? kOpen : kBlank;
      if (first >= 0 && (open * column > widest || (c - last) * column > kHidden)) close();
      if (first < 0) first = c;
      last = c, open = 0, ++measured;
    }
    close();
    if (!found.empty() && found.front().from < 2 * column) found.front().from = 0;
    if (!found.empty() && found.back().to > wall_.length() - 2 * column) found.back().to = wall_.length();
    return found;
  }

 private:
  const WallCandidate& wall_;
  std::vector<Support> columns_;
};

}  // namespace

double measured_length(const WallCandidate& wall) {
  double length = 0;
  for (int c = 0; c < wall.raster.columns; ++c)
    length += support_of(wall, c, c + 1) == Support::measured ? wall.raster.column : 0;
  return length;
}

std::vector<WallStretch> supported_stretches(const WallCandidate& wall, const std::vector<Opening>& kept) {
  Stretches stretches(wall);
  for (const Opening& opening : kept) stretches.keep(opening);
  return stretches.find();
}

}  // namespace parhelion::semantic

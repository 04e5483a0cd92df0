#include "fusion/semantic/pictures/plan_legend.hpp"

#include <cmath>
#include <cstdio>

#include "fusion/semantic/pictures/plan_palette.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kMaxRows = 2;
constexpr double kEdge = 8;  // pixels above the first row and below the last
constexpr double kLargestText = 16, kSmallestText = 6;

/// Scale bar of a round number of metres, about a tenth of the width; returns its end.
double paint_scale_bar(PlanCanvas& canvas, double x, double y) {
  const double wanted = 0.1 * canvas.width() / canvas.pixels_per_metre();
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  const double metres = wanted / power >= 5 ? 5 * power : wanted / power >= 2 ? 2 * power : power;
  const double end = x + metres * canvas.pixels_per_metre();
  canvas.pixel_line({x, y + 8}, {end, y + 8}, palette::kInk, 2);
  canvas.pixel_line({x, y + 3}, {x, y + 13}, palette::kInk, 2);
  canvas.pixel_line({end, y + 3}, {end, y + 13}, palette::kInk, 2);
  char label[32];
  std::snprintf(label, sizeof label, "%g m", metres);
  const double width = canvas.text_width(label, 12);
  canvas.text({(x + end - width) / 2, y - 4}, label, 12, palette::kInk);
  return std::max(end, (x + end + width) / 2);
}

}  // namespace

void PlanLegend::paint(PlanCanvas& canvas) const {
  const double top = canvas.plan_bottom();
  canvas.bar({Eigen::Vector2d(0, top), Eigen::Vector2d(canvas.width(), canvas.height())}, palette::kPaper);
  canvas.pixel_line({0, top}, {double(canvas.width()), top}, palette::kRule, 1);
  const double left = paint_scale_bar(canvas, 24, top + kHeight / 2.0) + 44;
  if (entries_.empty()) return;
  double size = kLargestText;
  auto at = places(canvas, left, size);
  for (; size > kSmallestText && at.back().row >= kMaxRows; size -= 0.5)
    at = places(canvas, left, size - 0.5);
  const double row_height = (kHeight - 2 * kEdge) / (at.back().row + 1);
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    paint_entry(canvas, entries_[i], {at[i].x, top + kEdge + row_height * (at[i].row + 0.5)}, size);
  }
}

/// Row by row, from the left.
std::vector<PlanLegend::Place> PlanLegend::places(const PlanCanvas& canvas, double left, double size) const {
  std::vector<Place> places;
  Place next{left, 0};
  for (const LegendEntry& entry : entries_) {
    const double width = 34 + canvas.text_width(entry.label, size);
    if (next.x > left && next.x + width > canvas.width() - 12) next = {left, next.row + 1};
    places.push_back(next);
    next.x += width + 30;
  }
  return places;
}

void PlanLegend::paint_entry(PlanCanvas& canvas, const LegendEntry& entry, const Eigen::Vector2d& at,
                             double size) {
  using Mark = LegendEntry::Mark;
  const auto stroke = [&](double from, double to, double width) {
    canvas.pixel_line({at.x() + from, at.y()}, {at.x() + to, at.y()}, entry.colour, width);
  };
  if (entry.mark == Mark::dot) canvas.pixel_disc({at.x() + 12, at.y()}, 4.5, entry.colour);
  if (entry.mark == Mark::line || entry.mark == Mark::body) stroke(1.5, 22.5, 3);
  if (entry.mark == Mark::body || entry.mark == Mark::area) stroke(6, 18, 12);
  canvas.text({at.x() + 34, at.y() + size / 2}, entry.label, size, palette::kInk);
}

}  // namespace parhelion::semantic

#include "fusion/semantic/segmentation/line_refiner.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr double kBlockSide = 0.32;   // m; small against a wall, large against a pixel
constexpr double kMaxGap = 0.5;       // m; narrower than any doorway
constexpr double kCoverageBin = 0.1;  // m; closer than the rays of a laser on a far wall
constexpr double kMinCoverage = 0.6;
constexpr double kMinContrast = 1.8;  // of clutter that fills the plan it is 1
constexpr int kMaxRounds = 30;

}  // namespace

LineRefiner::LineRefiner(std::span<const Eigen::Vector3f> evidence, double pixel, double near,
                         double min_length)
    : pixel_(pixel),
      near_(near),
      min_length_(min_length),
      evidence_(evidence, kBlockSide),
      claimed_(evidence_.sorted().size(), 0) {}

void LineRefiner::gather(const PlanLine& line, double low, double high, double band, bool claimed_too,
                         std::vector<Hit>& hits) const {
  hits.clear();
  const Eigen::Vector2d a = line.p + low * line.d, b = line.p + high * line.d;
  const double margin = band * 1.5;  // the band's corner is at most sqrt(2) bands off
  const int row0 = evidence_.coordinate(std::min(a.y(), b.y()) - margin);
  const int row1 = evidence_.coordinate(std::max(a.y(), b.y()) + margin);
  for (int row = row0; row <= row1; ++row) {
    // Intersection of the band with this row of blocks.
    double x0 = std::min(a.x(), b.x()), x1 = std::max(a.x(), b.x());
    if (std::abs(line.d.y()) > 0.05) {
      const double slope = line.d.x() / line.d.y();
      const double at0 = line.p.x() + (row * kBlockSide - margin - line.p.y()) * slope;
      const double at1 = line.p.x() + ((row + 1) * kBlockSide + margin - line.p.y()) * slope;
      x0 = std::max(x0, std::min(at0, at1));
      x1 = std::min(x1, std::max(at0, at1));
    }
    evidence_.for_each_in(evidence_.coordinate(x0 - margin), row, evidence_.coordinate(x1 + margin), row,
                          [&](const PlanBlocks::Block& block, std::size_t) {
                            for (std::uint32_t i = block.begin; i < block.end; ++i) {
                              if (claimed_[i] && !claimed_too) continue;
                              const Eigen::Vector3f& e = evidence_.sorted()[i];
                              const Eigen::Vector2d q = e.head<2>().cast<double>();
                              const double across = line.across(q);
                              if (!(std::abs(across) <= band)) continue;  // most are
                              const double along = line.along(q);
                              if (along >= low && along <= high)
                                hits.push_back({along, across, static_cast<double>(e.z()), i});
                            }
                          });
  }
}

bool LineRefiner::fit(PlanLine& line, const std::vector<Hit>& hits) const {
  double w = 0, wa = 0, wc = 0, waa = 0, wac = 0, wcc = 0;
  for (const Hit& h : hits) {
    if (h.along < line.low || h.along > line.high) continue;
    // Tukey's biweight: a second surface beside this one must not rotate it.
    const double r = h.across / near_, inside = 1 - r * r, weight = h.weight * inside * inside;
    w += weight;
    wa += weight * h.along;
    wc += weight * h.across;
    waa += weight * h.along * h.along;
    wac += weight * h.along * h.across;
    wcc += weight * h.across * h.across;
  }
  if (w <= 0) return false;
  const double ma = wa / w, mc = wc / w;
  const double turn = 0.5 * std::atan2(2 * (wac / w - ma * mc), (waa / w - ma * ma) - (wcc / w - mc * mc));
  if (std::abs(turn) > 0.5) return false;  // a blob, not a line
  const Eigen::Vector2d normal(-line.d.y(), line.d.x());
  const double middle = ma - (line.low + line.high) / 2;
  line.p += ma * line.d + mc * normal;
  line.d = (std::cos(turn) * line.d + std::sin(turn) * normal).normalized();
  const double half = (line.high - line.low) / 2;
  line.low = -half - middle;
  line.high = half - middle;
  line.weight = w;
  return true;
}

/// The stretch of evidence without a long gap that overlaps most with the current line.
bool LineRefiner::grow(PlanLine& line, std::vector<Hit>& hits) const {
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
    return std::tuple(a.along, a.index) < std::tuple(b.along, b.index);
  });
  double best = 0, low = 0, high = 0;
  for (std::size_t i = 0; i < hits.size();) {
    double inside = 0;
    std::size_t end = i;
    for (; end < hits.size() && (end == i || hits[end].along - hits[end - 1].along <= kMaxGap); ++end)
      inside += hits[end].along >= line.low && hits[end].along <= line.high ? hits[end].weight : 0;
    if (inside > best) {
      best = inside;
      low = hits[i].along;
      high = hits[end - 1].along;
    }
    i = end;
  }
  if (best <= 0) return false;
  line.low = low;
  line.high = high;
  return true;
}

bool LineRefiner::covered(const PlanLine& line, const std::vector<Hit>& hits) const {
  const double length = line.high - line.low;
  const auto bins = static_cast<std::size_t>(std::ceil(length / kCoverageBin));
  std::vector<std::uint8_t> filled(bins, 0);
  for (const Hit& h : hits) {
    if (h.along < line.low || h.along > line.high) continue;
    filled[std::min(bins - 1, static_cast<std::size_t>((h.along - line.low) / kCoverageBin))] = 1;
  }
  return static_cast<double>(std::count(filled.begin(), filled.end(), 1)) >=
         kMinCoverage * static_cast<double>(bins);
}

/// Clutter continues on both sides of any line through it; a surface has empty space on at least one side.
bool LineRefiner::stands_out(const PlanLine& line) const {
  std::vector<Hit> hits;
  gather(line, line.low, line.high, 2 * near_, false, hits);
  double inside = 0, left = 0, right = 0;
  for (const Hit& h : hits) (std::abs(h.across) <= near_ ? inside : h.across > 0 ? left : right) += h.weight;
  return inside >= kMinContrast * 2 * std::min(left, right);
}

std::optional<PlanLine> LineRefiner::refine(PlanLine line) const {
  std::vector<Hit> hits;
  for (int round = 0; round < kMaxRounds; ++round) {
    const PlanLine before = line;
    const double reach = std::max(1.0, (line.high - line.low) / 2);
    gather(line, line.low - reach, line.high + reach, near_, false, hits);
    if (!grow(line, hits) || !fit(line, hits)) return std::nullopt;
    if (line.high - line.low < min_length_ / 2) return std::nullopt;
    if (std::abs(before.across(line.p)) < pixel_ / 20 && std::abs(line.d.dot(before.d)) > 1 - 1e-6 &&
        std::abs((line.high - line.low) - (before.high - before.low)) < pixel_ / 2)
      break;
  }
  gather(line, line.low, line.high, near_, false, hits);
  if (line.high - line.low < min_length_ || !covered(line, hits) || !stands_out(line)) return std::nullopt;
  return line;
}

void LineRefiner::extend_to_corners(PlanLine& line) const {
  std::vector<Hit> hits;
  const double step = 2 * near_;
  gather(line, line.low - step, line.high + step, near_, true, hits);
  for (const Hit& hit : hits) {
    line.low = std::min(line.low, hit.along);
    line.high = std::max(line.high, hit.along);
  }
}

void LineRefiner::claim(const PlanLine& line) {
  std::vector<Hit> hits;
  gather(line, line.low - near_, line.high + near_, near_, true, hits);
  for (const Hit& hit : hits) claimed_[hit.index] = 1;
}

}  // namespace parhelion::semantic

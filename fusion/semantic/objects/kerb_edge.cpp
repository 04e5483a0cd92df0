#include "fusion/semantic/objects/kerb_edge.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kOffLine = 0.05;  // m, from the edge to the line through it
constexpr double kStraight = 0.6;  // of the bins must lie on the line
constexpr std::size_t kFewestBins = 4;
constexpr double kMixed = 0.1;  // of a side's points may lie on the other's height

bool is_low(double h) { return h < 0.35; }
bool is_high(double h) { return h > 0.65; }

/// The points of one stretch of the edge.
struct Bin {
  std::vector<double> face, high;  ///< m, v of the upright face's points and of the higher ground's
  int low_reach = 0, high_reach = 0;
};

/// Where the higher ground begins, m; nullopt: not measured.
std::optional<double> edge_in(Bin& bin) {
  constexpr std::size_t fewest_face = 4, fewest_high = 8;
  if (bin.face.size() >= fewest_face) return median(bin.face);
  if (bin.high.size() >= fewest_high) return quantile(bin.high, 0.03);
  return std::nullopt;
}

/// Measures the heights of both grounds at the middle of the edge, by least squares over parallel planes.
/// False: too much lies on the lower ground above the edge, or on the higher ground below it.
bool parts_grounds(std::span<const EdgePoint> points, KerbEdge& edge) {
  constexpr double at_edge = 0.12;  // m
  const double middle = 0.5 * (edge.from + edge.to);
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  Eigen::Vector4d heights = Eigen::Vector4d::Zero();
  double low = 0, high = 0, low_above = 0, high_below = 0;
  for (const EdgePoint& p : points) {
    const double v = p.v - edge.offset - edge.slope * p.u;
    if (!p.ground || p.u < edge.from || p.u > edge.to || std::abs(v) < at_edge || std::abs(v) > kKerbReach)
      continue;
    if (v < 0 ? !is_low(p.height) : !is_high(p.height)) {
      (v < 0 ? high_below : low_above) += 1;
      continue;
    }
    (v < 0 ? low : high) += 1;
    const Eigen::Vector4d row(1, v > 0 ? 1 : 0, p.u - middle, v);
    squares += row * row.transpose();
    heights += row * p.height;
  }
  if (high_below >= kMixed * low || low_above >= kMixed * high) return false;
  const Eigen::Vector4d fit = squares.ldlt().solve(heights);
  if (!fit.allFinite()) return false;
  edge.low = fit[0];
  edge.high = fit[0] + fit[1];
  return true;
}

/// Where the edge was measured, from one end to the other: u and v.
std::vector<Eigen::Vector2d> measured_edge(const KerbAxis& line, std::span<const EdgePoint> points) {
  const double begin = line.from - kKerbReach;
  std::vector<Bin> bins(static_cast<std::size_t>((line.to + kKerbReach - begin) / kKerbBin) + 1);
  for (const EdgePoint& p : points) {
    if (p.u < begin || p.u >= begin + kKerbBin * static_cast<double>(bins.size())) continue;
    Bin& bin = bins[static_cast<std::size_t>((p.u - begin) / kKerbBin)];
    if (std::abs(p.v) < 0.3 && p.height > 0.3 && p.height < 0.8) bin.face.push_back(p.v);
    if (p.v > -0.35 && p.v < 0.4 && is_high(p.height)) bin.high.push_back(p.v);
    bin.low_reach += p.v < -0.35 && p.v > -kKerbReach - kKerbBin && is_low(p.height);
    bin.high_reach += p.v > 0.35 && p.v < kKerbReach + kKerbBin && is_high(p.height);
  }
  std::vector<Eigen::Vector2d> at;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    if (bins[b].low_reach == 0 || bins[b].high_reach == 0) continue;
    if (const auto v = edge_in(bins[b]))
      at.emplace_back(begin + (static_cast<double>(b) + 0.5) * kKerbBin, *v);
  }
  return at;
}

/// A straight line by least squares; removes what is not on it from `at`.
KerbEdge fit_edge(std::vector<Eigen::Vector2d>& at) {
  KerbEdge edge;
  for (int round = 0; round < 4 && at.size() >= kFewestBins; ++round) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : at) mean += p;
    mean /= static_cast<double>(at.size());
    double uu = 0, uv = 0;
    for (const Eigen::Vector2d& p : at) {
      uu += (p.x() - mean.x()) * (p.x() - mean.x());
      uv += (p.x() - mean.x()) * (p.y() - mean.y());
    }
    edge.slope = uv / std::max(uu, 1e-9);
    edge.offset = mean.y() - edge.slope * mean.x();
    const double limit = kOffLine * (round < 2 ? 3 : 1);
    std::erase_if(at, [&](const Eigen::Vector2d& p) {
      return std::abs(p.y() - edge.offset - edge.slope * p.x()) > limit;
    });
  }
  return edge;
}

}  // namespace

std::optional<KerbEdge> kerb_edge(const KerbAxis& line, std::span<const EdgePoint> points) {
  std::vector<Eigen::Vector2d> at = measured_edge(line, points);
  const auto fewest = std::max(static_cast<double>(kFewestBins), kStraight * static_cast<double>(at.size()));
  KerbEdge edge = fit_edge(at);
  if (static_cast<double>(at.size()) < fewest) return std::nullopt;
  double longest = -1;
  for (std::size_t first = 0, end = 0; first < at.size(); first = end) {
    for (end = first + 1; end < at.size() && at[end].x() - at[end - 1].x() < kKerbGap;) ++end;
    const double length = at[end - 1].x() - at[first].x();
    if (length <= longest) continue;
    longest = length;
    edge.from = at[first].x() - kKerbBin / 2;
    edge.to = at[end - 1].x() + kKerbBin / 2;
    edge.measured = static_cast<double>(end - first) * kKerbBin / (edge.to - edge.from);
  }
  if (edge.to - edge.from < kShortestKerb || edge.measured < 0.5 || !parts_grounds(points, edge))
    return std::nullopt;
  return edge;
}

}  // namespace parhelion::semantic

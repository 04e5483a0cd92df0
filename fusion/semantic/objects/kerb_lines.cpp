#include "fusion/semantic/objects/kerb_lines.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace parhelion::semantic {
namespace {

constexpr double kHighest = 0.25;       // m, of the step
constexpr double kSteepest = 0.12;      // slope of either ground
constexpr double kParallel = 0.035;     // between the slopes of the two
constexpr double kUneven = 0.02;        // m, RMS of a cell's own plane
constexpr double kBeside = 0.2;         // m, from a line to the rough places of its pieces
constexpr std::size_t kMaxPieces = 60;  // of a group that lines are drawn through
constexpr int kMaxLines = 12;           // of a group
constexpr int kMaxFailures = 3;         // lines in succession that part no two grounds

/// Where a lower and a higher layer lie on two sides of a cell.
struct Piece {
  Eigen::Vector2d place;    ///< m, between the two
  Eigen::Vector2d towards;  ///< the higher one, length 1
  std::uint32_t low = 0, high = 0;
};
using Pieces = std::vector<Piece>;

/// Few points tell no slope; then their heights alone count.
bool is_level(const GroundLayers::Layer& layer) {
  constexpr double fewest = 3;
  if (!layer.is_floor() || layer.sums.count < fewest) return false;
  if (const auto plane = plane_through(layer.sums))
    return plane->slope.norm() < kSteepest && plane->rms < kUneven;
  const double z = layer.z();
  return std::sqrt(std::max(0.0, layer.sums.squares(2, 2) / layer.sums.count - z * z)) < kUneven;
}

/// All pairs of level layers with a step between them, and one or two cells.
Pieces pieces_of(const GroundLayers& ground, double lowest) {
  // Three cells where the edge lies on the border of two: both of these hold points of its face.
  constexpr std::array<std::array<int, 2>, 6> offsets{{{2, 0}, {0, 2}, {2, 2}, {2, -2}, {3, 0}, {0, 3}}};
  std::vector<bool> level;
  for (const GroundLayers::Layer& layer : ground.layers()) level.push_back(is_level(layer));
  Pieces pieces;
  for (std::uint32_t i = 0; i < level.size(); ++i) {
    if (!level[i]) continue;
    const GroundLayers::Layer& a = ground.layers()[i];
    for (const auto& [dx, dy] : offsets) {
      const auto [first, end] = ground.in_cell(a.x + dx, a.y + dy);
      for (std::uint32_t k = first; k < end; ++k) {
        const double rise = ground.layers()[k].z() - a.z();
        if (!level[k] || std::abs(rise) < lowest || std::abs(rise) > kHighest) continue;
        const Eigen::Vector2d p = a.sums.mean().head<2>(), q = ground.layers()[k].sums.mean().head<2>();
        pieces.push_back({0.5 * (p + q),
                          (rise > 0 ? Eigen::Vector2d(q - p) : Eigen::Vector2d(p - q)).normalized(),
                          rise > 0 ? i : k, rise > 0 ? k : i});
      }
    }
  }
  return pieces;
}

struct Run {
  KerbAxis line;
  std::vector<std::size_t> members;  ///< the pieces on it
};

/// The longest run of pieces without a gap along a line through `place`; up is about `towards`.
Run run_along(const Pieces& pieces, const Eigen::Vector2d& place, const Eigen::Vector2d& along,
              const Eigen::Vector2d& towards) {
  Run run;
  run.line.origin = place;
  run.line.along = along.normalized();
  run.line.up = {-run.line.along.y(), run.line.along.x()};
  if (run.line.up.dot(towards) < 0) run.line.along = -run.line.along, run.line.up = -run.line.up;
  std::vector<std::pair<double, std::size_t>> on;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Eigen::Vector2d at = run.line.at(pieces[i].place);
    if (std::abs(at.y()) < kBeside && run.line.up.dot(pieces[i].towards) > 0.5) on.emplace_back(at.x(), i);
  }
  std::sort(on.begin(), on.end());
  std::size_t best_begin = 0, best_end = 0;
  double longest = -1;
  for (std::size_t begin = 0, end = 0; begin < on.size(); begin = end) {
    for (end = begin + 1; end < on.size() && on[end].first - on[end - 1].first < kKerbGap;) ++end;
    const double length = on[end - 1].first - on[begin].first;
    if (length > longest) longest = length, best_begin = begin, best_end = end;
  }
  for (std::size_t k = best_begin; k < best_end; ++k) run.members.push_back(on[k].second);
  if (!run.members.empty()) run.line.from = on[best_begin].first, run.line.to = on[best_end - 1].first;
  return run;
}

/// The run along the line that fits its pieces best.
Run straightened(const Pieces& pieces, const Run& run) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), towards = Eigen::Vector2d::Zero();
  for (const std::size_t m : run.members) mean += pieces[m].place, towards += pieces[m].towards;
  mean /= static_cast<double>(run.members.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const std::size_t m : run.members)
    spread += (pieces[m].place - mean) * (pieces[m].place - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread);
  return run_along(pieces, mean, axes.eigenvectors().col(1), towards);
}

/// Pieces in groups that are near each other and at about one height.
std::vector<Pieces> groups_of(const GroundLayers& ground, const Pieces& pieces) {
  constexpr double apart = 0.06;  // m, of heights
  std::map<std::pair<int, int>, std::vector<std::size_t>> by_cell;
  const auto cell = [](const Piece& piece) { return GroundLayers::cell_of(piece.place); };
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Eigen::Vector2i c = cell(pieces[i]);
    by_cell[{c.x(), c.y()}].push_back(i);
  }
  const auto z = [&](std::uint32_t layer) { return ground.layers()[layer].z(); };
  std::vector<bool> taken(pieces.size());
  std::vector<Pieces> groups;
  for (std::size_t seed = 0; seed < pieces.size(); ++seed) {
    if (taken[seed]) continue;
    std::vector<std::size_t> open{seed};
    taken[seed] = true;
    Pieces group;
    while (!open.empty()) {
      const Piece& piece = pieces[open.back()];
      open.pop_back();
      group.push_back(piece);
      const Eigen::Vector2i c = cell(piece);
      for (int dy = -3; dy <= 3; ++dy) {
        for (int dx = -3; dx <= 3; ++dx) {
          const auto found = by_cell.find({c.x() + dx, c.y() + dy});
          if (found == by_cell.end()) continue;
          for (const std::size_t k : found->second) {
            if (taken[k] || std::abs(z(pieces[k].low) - z(piece.low)) > apart ||
                std::abs(z(pieces[k].high) - z(piece.high)) > apart)
              continue;
            taken[k] = true;
            open.push_back(k);
          }
        }
      }
    }
    groups.push_back(std::move(group));
  }
  return groups;
}

/// The plane through the layers of one side.
template <class Side>
std::optional<SlopedPlane> plane_of(const GroundLayers& ground, const Pieces& pieces,
                                    const std::vector<std::size_t>& members, Side side) {
  std::vector<std::uint32_t> layers;
  for (const std::size_t m : members) layers.push_back(side(pieces[m]));
  std::sort(layers.begin(), layers.end());
  layers.erase(std::unique(layers.begin(), layers.end()), layers.end());
  PlaneSums sums;
  for (const std::uint32_t i : layers) sums += ground.layers()[i].sums;
  return plane_through(sums);
}

/// Straight lines along a group's pieces, the longest first.
void find_lines(const GroundLayers& ground, Pieces pieces, double lowest, std::vector<KerbLine>& found) {
  int failures = 0;
  for (int round = 0; round < kMaxLines && failures < kMaxFailures; ++round) {
    Run best;
    const std::size_t stride = 1 + pieces.size() / kMaxPieces;
    for (std::size_t i = 0; i < pieces.size(); i += stride) {
      for (std::size_t k = 0; k < i; k += stride) {
        if ((pieces[k].place - pieces[i].place).norm() < kShortestKerb / 2) continue;
        Run run = run_along(pieces, pieces[i].place, pieces[k].place - pieces[i].place, pieces[i].towards);
        if (run.members.size() > best.members.size()) best = std::move(run);
      }
    }
    if (best.members.size() < 2) return;
    if (Run run = straightened(pieces, best); run.members.size() >= best.members.size())
      best = std::move(run);
    const auto& [line, members] = best;
    if (line.to - line.from < kShortestKerb - 2 * GroundLayers::kCell) return;
    ++failures;
    auto low = plane_of(ground, pieces, members, [](const Piece&p) { return p.low; }),
         high = plane_of(ground, pieces, members, [](const Piece&p) { return p.high; });
    if (low && high && (low->slope - high->slope).norm() < kParallel) {
      low->slope = high->slope = 0.5 * (low->slope + high->slope);
      const double rise = high->height(line.origin) - low->height(line.origin);
      if (rise > lowest && rise < kHighest) {
        found.push_back({line, *low, rise});
        failures = 0;
      }
    }
    std::vector<bool> used(pieces.size());
    for (const std::size_t m : members) used[m] = true;
    Pieces rest;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      if (!used[i]) rest.push_back(pieces[i]);
    }
    pieces = std::move(rest);
  }
}

}  // namespace

std::vector<KerbLine> kerb_lines(const GroundLayers& ground, double lowest) {
  std::vector<KerbLine> found;
  for (Pieces& group : groups_of(ground, pieces_of(ground, lowest)))
    find_lines(ground, std::move(group), lowest, found);
  return found;
}

}  // namespace parhelion::semantic

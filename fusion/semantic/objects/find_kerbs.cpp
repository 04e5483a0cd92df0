#include "fusion/semantic/objects/find_kerbs.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "fusion/semantic/net/ground_layers.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kLowest = 0.05, kHighest = 0.25;  // m, of the step
constexpr double kShortest = 1.5;                  // m
constexpr double kSteepest = 0.12;                 // slope of either ground
constexpr double kParallel = 0.035;                // between the slopes of the two
constexpr double kUneven = 0.02;                   // m, RMS of a cell's own plane
constexpr double kBeside = 0.2;                    // m, from a line to the rough places of its pieces
constexpr double kGap = 2.0;                       // m, that nothing was measured over
constexpr double kReach = 0.6;                     // m, that either ground goes on for
constexpr double kBin = 0.25;                      // m, along the edge
constexpr double kOffLine = 0.05;                  // m, from the edge to the line through it
constexpr double kStraight = 0.6;                  // of the bins must lie on the line
constexpr std::size_t kFewestBins = 4;
constexpr double kMixed = 0.1;          // of a side's points may lie on the other's height
constexpr double kDeep = 0.15;          // m, of the box behind the edge
constexpr std::size_t kMaxPieces = 60;  // of a group that lines are drawn through
constexpr int kMaxLines = 12;           // of a group; so rough terrain costs no more than its size
constexpr int kMaxFailures = 3;         // lines in succession that part no two grounds

/// Where a lower and a higher layer lie on two sides of a cell.
struct Piece {
  Eigen::Vector2d place;    ///< m, between the two
  Eigen::Vector2d towards;  ///< the higher one, length 1
  std::uint32_t low = 0, high = 0;
};
using Pieces = std::vector<Piece>;

/// Coordinates at a line: u along it, v towards its higher side; m.
struct Line {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero(), along = Eigen::Vector2d::UnitX(),
                  up = Eigen::Vector2d::UnitY();
  double from = 0, to = 0;  ///< m, along it
  Eigen::Vector2d at(const Eigen::Vector2d& p) const { return {along.dot(p - origin), up.dot(p - origin)}; }
  Eigen::Vector2d place(double u) const { return origin + u * along; }
};

struct EdgePoint {
  double u = 0, v = 0;  ///< m, at the candidate's line
  double height = 0;    ///< over the lower ground, as a fraction of the step
  bool ground = false;  ///< by its label
};

struct Candidate {
  Line line;
  SlopedPlane low;  ///< the higher ground is parallel to it
  double rise = 0;  ///< m
  std::vector<EdgePoint> points;
};

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
  Line line;
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
    for (end = begin + 1; end < on.size() && on[end].first - on[end - 1].first < kGap;) ++end;
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

/// Straight lines along a group's pieces, the longest first (as in RANSAC, but through a fixed choice of
/// pairs: Fischler and Bolles 1981).
void find_lines(const GroundLayers& ground, Pieces pieces, double lowest, std::vector<Candidate>& found) {
  int failures = 0;
  for (int round = 0; round < kMaxLines && failures < kMaxFailures; ++round) {
    Run best;
    const std::size_t stride = 1 + pieces.size() / kMaxPieces;
    for (std::size_t i = 0; i < pieces.size(); i += stride) {
      for (std::size_t k = 0; k < i; k += stride) {
        if ((pieces[k].place - pieces[i].place).norm() < kShortest / 2) continue;
        Run run = run_along(pieces, pieces[i].place, pieces[k].place - pieces[i].place, pieces[i].towards);
        if (run.members.size() > best.members.size()) best = std::move(run);
      }
    }
    if (best.members.size() < 2) return;
    if (Run run = straightened(pieces, best); run.members.size() >= best.members.size())
      best = std::move(run);
    const auto& [line, members] = best;
    if (line.to - line.from < kShortest - 2 * GroundLayers::kCell) return;
    ++failures;
    auto low = plane_of(ground, pieces, members, [](const Piece&p) { return p.low; }),
         high = plane_of(ground, pieces, members, [](const Piece&p) { return p.high; });
    if (low && high && (low->slope - high->slope).norm() < kParallel) {
      low->slope = high->slope = 0.5 * (low->slope + high->slope);
      const double rise = high->height(line.origin) - low->height(line.origin);
      if (rise > lowest && rise < kHighest) {
        found.push_back({line, *low, rise, {}});
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

/// Gives each candidate the points around it.
void gather(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
            std::vector<Candidate>& candidates) {
  const auto key = [](const Eigen::Vector2i& cell) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(cell.x())) << 32 |
           static_cast<std::uint32_t>(cell.y());
  };
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> near;
  for (std::uint32_t c = 0; c < candidates.size(); ++c) {
    const Line& line = candidates[c].line;
    for (double u = line.from - kReach; u <= line.to + kReach; u += kBin / 2) {
      for (double v = -kReach - kBin; v <= kReach + kBin; v += kBin / 2) {
        auto& here = near[key(GroundLayers::cell_of(line.place(u) + v * line.up))];
        if (here.empty() || here.back() != c) here.push_back(c);
      }
    }
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto label = static_cast<EntityLabel>(labels[i]);
    if (!is_ground(label) && label != EntityLabel::unknown) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const auto found = near.find(key(GroundLayers::cell_of(p.head<2>())));
    if (found == near.end()) continue;
    for (const std::uint32_t c : found->second) {
      Candidate& candidate = candidates[c];
      const double h = (p.z() - candidate.low.height(p.head<2>())) / candidate.rise;
      if (h < -0.5 || h > 1.5) continue;
      const Eigen::Vector2d at = candidate.line.at(p.head<2>());
      candidate.points.push_back({at.x(), at.y(), h, is_ground(label)});
    }
  }
}

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

struct Edge {
  double offset = 0, slope = 0;  ///< v = offset + slope * u
  double from = 0, to = 0;       ///< m, along the candidate's line
  double measured = 0;           ///< share of its length
  double low = 0, high = 1;      ///< heights of both grounds at its middle, in candidate's steps
};

/// Measures the heights of both grounds at the middle of the edge, by least squares over parallel planes.
/// False: too much lies on the lower ground above the edge, or on the higher ground below it.
bool parts_grounds(const Candidate& candidate, Edge& edge) {
  constexpr double at_edge = 0.12;  // m
  const double middle = 0.5 * (edge.from + edge.to);
  Eigen::Matrix4d squares = Eigen::Matrix4d::Zero();
  Eigen::Vector4d heights = Eigen::Vector4d::Zero();
  double low = 0, high = 0, low_above = 0, high_below = 0;
  for (const EdgePoint& p : candidate.points) {
    const double v = p.v - edge.offset - edge.slope * p.u;
    if (!p.ground || p.u < edge.from || p.u > edge.to || std::abs(v) < at_edge || std::abs(v) > kReach)
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
std::vector<Eigen::Vector2d> measured_edge(const Candidate& candidate) {
  const Line& line = candidate.line;
  const double begin = line.from - kReach;
  std::vector<Bin> bins(static_cast<std::size_t>((line.to + kReach - begin) / kBin) + 1);
  for (const EdgePoint& p : candidate.points) {
    if (p.u < begin || p.u >= begin + kBin * static_cast<double>(bins.size())) continue;
    Bin& bin = bins[static_cast<std::size_t>((p.u - begin) / kBin)];
    if (std::abs(p.v) < 0.3 && p.height > 0.3 && p.height < 0.8) bin.face.push_back(p.v);
    if (p.v > -0.35 && p.v < 0.4 && is_high(p.height)) bin.high.push_back(p.v);
    bin.low_reach += p.v < -0.35 && p.v > -kReach - kBin && is_low(p.height);
    bin.high_reach += p.v > 0.35 && p.v < kReach + kBin && is_high(p.height);
  }
  std::vector<Eigen::Vector2d> at;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    if (bins[b].low_reach == 0 || bins[b].high_reach == 0) continue;
    if (const auto v = edge_in(bins[b])) at.emplace_back(begin + (static_cast<double>(b) + 0.5) * kBin, *v);
  }
  return at;
}

/// A straight line by least squares; removes what is not on it from `at`.
Edge fit_edge(std::vector<Eigen::Vector2d>& at) {
  Edge edge;
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

std::optional<Edge> edge_of(const Candidate& candidate) {
  std::vector<Eigen::Vector2d> at = measured_edge(candidate);
  const auto fewest = std::max(static_cast<double>(kFewestBins), kStraight * static_cast<double>(at.size()));
  Edge edge = fit_edge(at);
  if (static_cast<double>(at.size()) < fewest) return std::nullopt;
  double longest = -1;
  for (std::size_t first = 0, end = 0; first < at.size(); first = end) {
    for (end = first + 1; end < at.size() && at[end].x() - at[end - 1].x() < kGap;) ++end;
    const double length = at[end - 1].x() - at[first].x();
    if (length <= longest) continue;
    longest = length;
    edge.from = at[first].x() - kBin / 2;
    edge.to = at[end - 1].x() + kBin / 2;
    edge.measured = static_cast<double>(end - first) * kBin / (edge.to - edge.from);
  }
  if (edge.to - edge.from < kShortest || edge.measured < 0.5 || !parts_grounds(candidate, edge))
    return std::nullopt;
  return edge;
}

/// Whether most of it lies at a step of a flight, or at a ramp.
bool is_of_entity(const ModelObject& kerb, const std::vector<ModelEntity>& entities) {
  constexpr double margin = 0.35;
  constexpr int samples = 16;
  int inside = 0;
  for (int s = 0; s < samples; ++s) {
    const Eigen::Vector3d p =
        kerb.T_map_body * Eigen::Vector3d(((s + 0.5) / samples - 0.5) * kerb.size.x(), -kerb.size.y() / 2, 0);
    inside += std::any_of(entities.begin(), entities.end(), [&](const ModelEntity& e) {
      if ((e.label != EntityLabel::stairs && e.label != EntityLabel::ramp) || !is_solid(e)) return false;
      const Eigen::Vector3d at = e.T_map_body.inverse() * p;
      return std::abs(at.x()) < e.size.x() / 2 + margin && std::abs(at.y()) < e.size.y() / 2 + margin &&
             std::abs(at.z()) < e.size.z() / 2 + margin;
    });
  }
  return 2 * inside > samples;
}

ModelObject object_of(const Candidate& candidate, const Edge& edge) {
  const double u = 0.5 * (edge.from + edge.to), tilt = std::atan(edge.slope);
  const Line& line = candidate.line;
  const Eigen::Vector2d along = (line.along + edge.slope * line.up).normalized(), up(-along.y(), along.x());
  const Eigen::Vector2d on_edge = line.place(u) + (edge.offset + edge.slope * u) * line.up,
                        middle = on_edge + kDeep / 2 * up;
  const double ground = candidate.low.height(on_edge), bottom = ground + edge.low * candidate.rise,
               top = ground + edge.high * candidate.rise;
  ModelObject kerb;
  kerb.kind = ObjectKind::kerb;
  kerb.T_map_body = Transform<Map, Body>(
      Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Eigen::Vector3d::UnitZ())),
      Eigen::Vector3d(middle.x(), middle.y(), 0.5 * (bottom + top)));
  kerb.size = {(edge.to - edge.from) / std::cos(tilt), kDeep, top - bottom};
  kerb.confidence = std::min(1.0, edge.measured);
  kerb.movable = false;
  return kerb;
}

/// Whether most of `kerb` lies along `other`.
bool is_same(const ModelObject& kerb, const ModelObject& other) {
  const Eigen::Vector3d at = other.T_map_body.inverse() * kerb.T_map_body.translation();
  const double turn = std::abs(std::sin(kerb.T_map_body.yaw() - other.T_map_body.yaw()));
  return std::abs(at.x()) < other.size.x() / 2 && std::abs(at.y()) < 0.4 && turn < 0.3;
}

}  // namespace

std::vector<ModelObject> find_kerbs(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
                                    const std::vector<ModelEntity>& entities, double voxel) {
  const GroundLayers ground(cloud, labels);
  const double lowest = std::max(kLowest, 2 * voxel);
  std::vector<Candidate> candidates;
  for (Pieces& group : groups_of(ground, pieces_of(ground, lowest)))
    find_lines(ground, std::move(group), lowest, candidates);
  if (candidates.empty()) return {};
  gather(cloud, labels, candidates);
  std::vector<ModelObject> kerbs;
  for (const Candidate& candidate : candidates) {
    const auto edge = edge_of(candidate);
    if (!edge) continue;
    ModelObject kerb = object_of(candidate, *edge);
    const auto is_known = [&](const ModelObject& other) { return is_same(kerb, other); };
    if (is_of_entity(kerb, entities) || std::any_of(kerbs.begin(), kerbs.end(), is_known)) continue;
    kerb.name = "kerb " + std::to_string(kerbs.size() + 1);
    kerbs.push_back(std::move(kerb));
  }
  return kerbs;
}

}  // namespace parhelion::semantic

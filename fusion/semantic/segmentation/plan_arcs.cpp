#include "fusion/semantic/segmentation/plan_arcs.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "fusion/cloud/parallel.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kLargest = 100;      ///< m, a radius
constexpr double kApart = 1.0;        ///< m, maximum gap between neighbouring lines of an arc
constexpr double kMinTurn = 0.07;     ///< rad, minimum between them: less is one line seen twice
constexpr double kMaxTurn = 1.05;     ///< rad
constexpr double kLayers = 0.2;       ///< m, across: imperfectly aligned scans show one wall in layers
constexpr double kGap = 0.5;          ///< m along, as between the pieces of a line
constexpr double kMinSagitta = 0.15;  ///< m: a flatter arc is a wall that is not quite straight
constexpr double kBin = 0.1;          ///< m along
constexpr double kCovered = 0.6;      ///< minimum fraction of bins
constexpr double kSharp = 0.7;        ///< of the evidence within kLayers, within kThick of the arc
constexpr double kThick = 0.1;        ///< m
constexpr double kReplaced = 0.7;     ///< minimum fraction of a line that runs along the arc
constexpr double kMinSpread = 0.005;  ///< m, minimum standard deviation of the points

struct Hit {
  double along, across, weight;
  Eigen::Vector2d p;
};

Eigen::Vector2d middle_of(const PlanLine& line) { return line.p + 0.5 * (line.low + line.high) * line.d; }

/// Intersection of both perpendicular bisectors: exact for chords and for tangents.
std::optional<PlanArc> through(const PlanLine& a, const PlanLine& b, double smallest) {
  const Eigen::Vector2d normal_a(-a.d.y(), a.d.x()), p = middle_of(a), q = middle_of(b);
  const double sine = normal_a.dot(b.d);
  if (std::abs(sine) < std::sin(kMinTurn) || std::abs(sine) > std::sin(kMaxTurn)) return std::nullopt;
  if (std::abs(a.d.dot(b.d)) < 0.4) return std::nullopt;
  // (p + t n_a - q) is orthogonal to b.d
  const double t = (q - p).dot(b.d) / sine;
  PlanArc arc;
  arc.centre = p + t * normal_a;
  const double to_a = (p - arc.centre).norm(), to_b = (q - arc.centre).norm();
  arc.radius = 0.5 * (to_a + to_b);
  if (std::abs(to_a - to_b) > 2 * kLayers || arc.radius < smallest || arc.radius > kLargest)
    return std::nullopt;
  const Eigen::Vector2d d = 0.5 * (p + q) - arc.centre;
  arc.middle = std::atan2(d.y(), d.x());
  for (const PlanLine* line : {&a, &b}) {
    for (const double s : {line->low, line->high}) {
      const double at = arc.along(line->p + s * line->d);
      arc.low = std::min(arc.low, at), arc.high = std::max(arc.high, at);
    }
  }
  return arc;
}

double apart(const PlanLine& a, const PlanLine& b) {
  double nearest = std::numeric_limits<double>::infinity();
  const auto from_ends = [&](const PlanLine& one, const PlanLine& other) {
    for (const double s : {one.low, one.high}) {
      const Eigen::Vector2d p = one.p + s * one.d;
      const double at = std::clamp(other.along(p), other.low, other.high);
      nearest = std::min(nearest, (other.p + at * other.d - p).norm());
    }
  };
  from_ends(a, b);
  from_ends(b, a);
  return nearest;
}

class ArcFitter {
 public:
  ArcFitter(const PlanBlocks& evidence, double near) : evidence_(evidence), near_(near) {}

  /// Extended along the evidence and fitted to it, in bands from wide to as narrow as the evidence.
  bool refine(PlanArc& arc, double smallest) const {
    if (!refine(arc, smallest, 2 * kLayers) || !refine(arc, smallest, kLayers)) return false;
    double weight = 0, squares = 0;
    for (const Hit& hit : gather(arc, arc.low, arc.high, kLayers)) {
      weight += hit.weight;
      squares += hit.weight * hit.across * hit.across;
    }
    const double band = std::max(near_, 3 * std::sqrt(squares / weight));
    return band > kLayers || refine(arc, smallest, band);
  }

  std::vector<Hit> gather(const PlanArc& arc, double low, double high, double band) const {
    Eigen::Vector2d first = arc.at(low), last = first;
    const int steps = 1 + static_cast<int>((high - low) / 0.2);
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector2d p = arc.at(low + (high - low) * i / steps);
      first = first.cwiseMin(p), last = last.cwiseMax(p);
    }
    const double margin = band + 0.2, side = evidence_.side();
    std::vector<Hit> hits;
    evidence_.for_each_in(evidence_.coordinate(first.x() - margin), evidence_.coordinate(first.y() - margin),
                          evidence_.coordinate(last.x() + margin), evidence_.coordinate(last.y() + margin),
                          [&](const PlanBlocks::Block& block, std::size_t) {
                            const Eigen::Vector2d middle =
                                side * Eigen::Vector2d(block.x + 0.5, block.y + 0.5);
                            if (std::abs(arc.across(middle)) > band + side) return;
                            for (std::uint32_t i = block.begin; i < block.end; ++i) {
                              const Eigen::Vector3f& e = evidence_.sorted()[i];
                              const Eigen::Vector2d q = e.head<2>().cast<double>();
                              const double across = arc.across(q);
                              if (!(std::abs(across) <= band)) continue;  // most are
                              const double along = arc.along(q);
                              if (along >= low && along <= high)
                                hits.push_back({along, across, static_cast<double>(e.z()), q});
                            }
                          });
    std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
      return std::tuple(a.along, a.across) < std::tuple(b.along, b.across);
    });
    return hits;
  }

 private:
  bool refine(PlanArc& arc, double smallest, double band) const {
    for (int round = 0; round < 12; ++round) {
      const double reach = 1.0, half_turn = std::numbers::pi * arc.radius;
      const double low = std::max(arc.low - reach, -half_turn), high = std::min(arc.high + reach, half_turn);
      const std::vector<Hit> hits = gather(arc, low, high, band);
      if (!grow(arc, hits) || !fit(arc, hits, band)) return false;
      if (arc.radius < smallest || arc.radius > kLargest) return false;
    }
    return true;
  }

  /// Reduces it to the stretch without a long gap that overlaps most with the current arc.
  static bool grow(PlanArc& arc, const std::vector<Hit>& hits) {
    double best = 0, low = 0, high = 0;
    for (std::size_t i = 0; i < hits.size();) {
      double inside = 0;
      std::size_t end = i;
      for (; end < hits.size() && (end == i || hits[end].along - hits[end - 1].along <= kGap); ++end)
        inside += hits[end].along >= arc.low && hits[end].along <= arc.high ? hits[end].weight : 0;
      if (inside > best) best = inside, low = hits[i].along, high = hits[end - 1].along;
      i = end;
    }
    arc.low = low, arc.high = high;
    return best > 0 && high > low;
  }

  static bool fit(PlanArc& arc, const std::vector<Hit>& hits, double band) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    // In the frame of the arc's middle: its motion outward and sideways, and its curvature.
    const Eigen::Vector2d out(std::cos(arc.middle), std::sin(arc.middle)), side(-out.y(), out.x());
    for (const Hit& hit : hits) {
      if (hit.along < arc.low || hit.along > arc.high) continue;
      const double r = hit.across / band, inside = 1 - r * r, weight = hit.weight * inside * inside;
      const Eigen::Vector2d ray = (hit.p - arc.centre).normalized();
      const Eigen::Vector3d row(1, ray.dot(side), ray.dot(out) - 1);
      A += weight * row * row.transpose();
      b += weight * hit.across * row;
    }
    const Eigen::Vector3d x = A.ldlt().solve(b);
    if (!x.allFinite()) return false;
    // d = |p - c| - r; moving the centre by (o, s) and the radius by g changes it by -(o cos + s sin) - g.
    const Eigen::Vector2d from = arc.at(arc.low), to = arc.at(arc.high),
                          mid = arc.at(0.5 * (arc.low + arc.high));
    arc.centre += x(2) * out + x(1) * side;
    arc.radius += x(0) - x(2);
    if (!(arc.radius > 0)) return false;
    const Eigen::Vector2d d = mid - arc.centre;
    arc.middle = std::atan2(d.y(), d.x());
    arc.low = arc.along(from), arc.high = arc.along(to);
    if (arc.low > 0) arc.low -= 2 * std::numbers::pi * arc.radius;
    if (arc.high < 0) arc.high += 2 * std::numbers::pi * arc.radius;
    return true;
  }

  const PlanBlocks& evidence_;
  double near_;
};

/// Quality of a shape against the points: bins along the arc and along the lines that leave it, each with the
/// mean square of the distances of its points. A bin of little evidence counts for as much less.
struct Explained {
  double bins = 0, squares = 0;
  void add(double bin, double square) { bins += bin, squares += bin * square; }
  double criterion(double parameters) const {
    return bins * std::log(squares / bins) + parameters * std::log(bins);
  }
};

bool is_near(const Eigen::Vector2d& p, const PlanArc& arc) {
  const double at = arc.along(p);
  return std::abs(arc.across(p)) < kLayers && at > arc.low - kLayers && at < arc.high + kLayers;
}

bool runs_along(const PlanLine& line, const PlanArc& arc) {
  int near = 0, all = 0;
  for (double s = line.low; s <= line.high; s += kBin) {
    ++all;
    near += is_near(line.p + s * line.d, arc) ? 1 : 0;
  }
  return near >= kReplaced * all;
}

struct ArcBin {
  double weight = 0, across = 0, squares = 0;
  Eigen::Vector2d p = Eigen::Vector2d::Zero();
};

std::vector<ArcBin> bins_along(const PlanArc& arc, const std::vector<Hit>& hits) {
  std::map<int, ArcBin> bins;
  for (const Hit& hit : hits) {
    ArcBin& bin = bins[static_cast<int>(std::floor((hit.along - arc.low) / kBin))];
    bin.weight += hit.weight;
    bin.across += hit.weight * hit.across;
    bin.squares += hit.weight * hit.across * hit.across;
    bin.p += hit.weight * hit.p;
  }
  std::vector<ArcBin> result;
  for (const auto& [index, bin] : bins) result.push_back(bin);
  return result;
}

/// m, from the lines that are beside it, at most kLayers.
double distance_from(const std::vector<PlanLine>& lines, const Eigen::Vector2d& p) {
  double nearest = kLayers;
  for (const PlanLine& line : lines) {
    const double at = line.along(p);
    if (at > line.low - kBin && at < line.high + kBin) nearest = std::min(nearest, std::abs(line.across(p)));
  }
  return nearest;
}

/// Whether the arc describes the points as well as the lines that it would replace, with fewer parameters.
/// What these run along where the arc does not is unexplained by the arc. `kept`: the other lines, which stay
/// either way: their points are no evidence for an arc through the corners of a polygon.
bool better_than_lines(const PlanArc& arc, const std::vector<Hit>& hits, const std::vector<PlanLine>& lines,
                       const std::vector<PlanLine>& kept) {
  const std::vector<ArcBin> bins = bins_along(arc, hits);
  if (static_cast<double>(bins.size()) * kBin < kCovered * (arc.high - arc.low)) return false;
  std::vector<double> weights;
  for (const ArcBin& bin : bins) weights.push_back(bin.weight);
  const double usual = quantile(weights, 0.5);
  Explained round, straight;
  for (const ArcBin& bin : bins) {
    const double mean = bin.across / bin.weight, share = std::min(1.0, bin.weight / usual);
    const double spread = std::max(bin.squares / bin.weight - mean * mean, kMinSpread * kMinSpread);
    const Eigen::Vector2d p = bin.p / bin.weight;
    const double others = distance_from(kept, p), to_lines = std::min(distance_from(lines, p), others),
                 to_arc = std::min(std::abs(mean), others);
    round.add(share, spread + to_arc * to_arc);
    straight.add(share, spread + to_lines * to_lines);
  }
  for (const PlanLine& line : lines) {
    const double of_bin = line.weight * kBin / (line.high - line.low), share = std::min(1.0, of_bin / usual);
    for (double s = line.low; s <= line.high; s += kBin) {
      if (is_near(line.p + s * line.d, arc)) continue;
      round.add(share, kMinSpread * kMinSpread + kLayers * kLayers);
      straight.add(share, kMinSpread * kMinSpread);
    }
  }
  return round.criterion(5) < straight.criterion(2 * static_cast<double>(lines.size()) + 2);
}

/// Whether its evidence is a sheet: things that stand about fill the whole band around an arc.
bool is_sharp(const std::vector<Hit>& hits) {
  double all = 0, near = 0;
  for (const Hit& hit : hits) {
    all += hit.weight;
    near += std::abs(hit.across) < kThick ? hit.weight : 0;
  }
  return near > kSharp * all;
}

double sagitta(const PlanArc& arc) {
  const double half = std::min((arc.high - arc.low) / (2 * arc.radius), std::numbers::pi);
  return arc.radius * (1 - std::cos(half));
}

struct Pair {
  double weight;
  std::size_t a, b;
};

std::vector<Pair> neighbours(const std::vector<PlanLine>& lines) {
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < lines.size(); ++a) {
    for (std::size_t b = a + 1; b < lines.size(); ++b) {
      const double reach = lines[a].high - lines[a].low + lines[b].high - lines[b].low + kApart;
      if ((middle_of(lines[a]) - middle_of(lines[b])).norm() > reach) continue;
      if (apart(lines[a], lines[b]) < kApart) pairs.push_back({lines[a].weight + lines[b].weight, a, b});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& one, const Pair& other) { return one.weight > other.weight; });
  return pairs;
}

/// The fitted arcs of pairs of lines, in the order of the pairs. Some are fitted at once by all threads,
/// before it is known whether an arc of an earlier pair replaces their lines: which arcs these are does not
/// depend on it.
class ArcsOfPairs {
 public:
  ArcsOfPairs(const ArcFitter& fitter, const std::vector<PlanLine>& lines, double smallest)
      : fitter_(fitter),
        lines_(lines),
        smallest_(smallest),
        pairs_(neighbours(lines)),
        arcs_(pairs_.size()) {}
  const std::vector<Pair>& pairs() const { return pairs_; }

  /// nullopt: its lines are no pieces of an arc. To be asked for in ascending order.
  const std::optional<PlanArc>& of(std::size_t pair, const std::vector<bool>& replaced) {
    if (pair >= fitted_) fit_from(pair, replaced);
    return arcs_[pair];
  }

 private:
  void fit_from(std::size_t first, const std::vector<bool>& replaced) {
    constexpr std::size_t kAtOnce = 16;
    fitted_ = std::min(pairs_.size(), first + kAtOnce);
    cloud::for_each_chunk(fitted_ - first, 1, 0, [&](std::size_t k, std::size_t, std::size_t) {
      const Pair& pair = pairs_[first + k];
      if (!replaced[pair.a] && !replaced[pair.b]) arcs_[first + k] = fitted(pair);
    });
  }
  std::optional<PlanArc> fitted(const Pair& pair) const {
    auto arc = through(lines_[pair.a], lines_[pair.b], smallest_);
    return arc && fitter_.refine(*arc, smallest_) && !(sagitta(*arc) < kMinSagitta) ? arc : std::nullopt;
  }

  const ArcFitter& fitter_;
  const std::vector<PlanLine>& lines_;
  double smallest_;
  std::vector<Pair> pairs_;
  std::vector<std::optional<PlanArc>> arcs_;
  std::size_t fitted_ = 0;
};

}  // namespace

std::vector<PlanArc> find_arcs(const PlanBlocks& evidence, double near, double min_length,
                               std::vector<PlanLine>& lines) {
  const ArcFitter fitter(evidence, near);
  // A tighter one would have facets shorter than any line.
  const double smallest = min_length * min_length / (4 * near);
  std::vector<PlanArc> arcs;
  std::vector<bool> replaced(lines.size());
  ArcsOfPairs arcs_of_pairs(fitter, lines, smallest);
  for (std::size_t k = 0; k < arcs_of_pairs.pairs().size(); ++k) {
    const Pair& pair = arcs_of_pairs.pairs()[k];
    if (replaced[pair.a] || replaced[pair.b]) continue;
    std::optional<PlanArc> arc = arcs_of_pairs.of(k, replaced);
    if (!arc) continue;
    std::vector<PlanLine> along, kept;
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (replaced[i]) continue;
      if (!runs_along(lines[i], *arc)) {
        kept.push_back(lines[i]);
        continue;
      }
      along.push_back(lines[i]);
      which.push_back(i);
    }
    if (along.size() < 2) continue;
    const std::vector<Hit> hits = fitter.gather(*arc, arc->low, arc->high, kLayers);
    if (!is_sharp(hits) || !better_than_lines(*arc, hits, along, kept)) continue;
    for (const std::size_t i : which) replaced[i] = true;
    const double half_turn = std::numbers::pi * arc->radius;
    if (arc->high - arc->low > 2 * half_turn - kGap) arc->low = -half_turn, arc->high = half_turn;
    arcs.push_back(*arc);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (!replaced[i]) lines[kept++] = lines[i];
  }
  lines.resize(kept);
  return arcs;
}

std::vector<Eigen::Vector2d> corners_of(const PlanArc& arc, double near) {
  const double length = arc.high - arc.low, longest = 2 * std::sqrt(arc.radius * near);
  const int pieces = std::max(1, static_cast<int>(std::ceil(length / longest)));
  PlanArc outer = arc;
  // The chords' mean distance from the arc is two thirds of the sagitta; half of it is added outwards.
  const double half = length / (2 * pieces * arc.radius);
  outer.radius += arc.radius * (1 - std::cos(half)) * 2 / 3;
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i <= pieces; ++i)
    corners.push_back(outer.at((arc.low + length * i / pieces) * outer.radius / arc.radius));
  return corners;
}

}  // namespace parhelion::semantic

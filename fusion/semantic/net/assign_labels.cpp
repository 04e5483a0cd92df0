#include <algorithm>
#include <cmath>
#include <set>

#include "fusion/semantic/net/factor_graph.hpp"
#include "fusion/semantic/net/net_entities.hpp"
#include "fusion/semantic/net/wall_storeys.hpp"
#include "protocols/nearest_on_segment.hpp"

namespace parhelion::semantic {
namespace {

// Scores of relations, in logarithms: the odds that two labels occur together against chance.
constexpr double kAtRightAngles = 0.25;  ///< walls that are parallel or orthogonal
constexpr double kOnLevel = 0.4;         ///< a wall that stands on a floor or carries a ceiling
constexpr double kInNoWall = -8;         ///< a door or a window without a wall
constexpr double kRepeats = 4;           ///< against a shorter wall in the place of a longer one
constexpr double kLeaf = 2;              ///< a surface that is the leaf of a door
constexpr double kTwice = -6;            ///< two walls in the same place
constexpr double kTreadAndFloor = -6;    ///< a step's tread that is also a floor
constexpr double kTreadOfFlight = -6;    ///< the same, of a long flight
constexpr double kNextStep = 1.5;        ///< a step above and parallel to a step

/// One variable of the graph and the meaning of its labels.
struct Variable {
  std::size_t index = 0;
  std::vector<EntityLabel> labels;
};

class Net {
 public:
  Variable add(const std::vector<std::pair<EntityLabel, double>>& scores) {
    Variable variable;
    Eigen::VectorXd values(static_cast<Eigen::Index>(scores.size()));
    for (std::size_t i = 0; i < scores.size(); ++i) {
      variable.labels.push_back(scores[i].first);
      values(static_cast<Eigen::Index>(i)) = scores[i].second;
    }
    variable.index = graph_.add_variable(values);
    unary_.push_back(values);
    return variable;
  }
  /// A score for label `a` of one variable together with label `b` of the other.
  void relate(const Variable& a, EntityLabel label_a, const Variable& b, EntityLabel label_b, double worth) {
    Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(a.labels.size()),
                                                   static_cast<Eigen::Index>(b.labels.size()));
    scores(place(a, label_a), place(b, label_b)) = worth;
    graph_.add_pair(a.index, b.index, scores);
  }
  /// Labels of several variables that the solution tries at once.
  void propose(const std::vector<std::pair<Variable, EntityLabel>>& labels) {
    FactorGraph::Proposal proposal;
    for (const auto& [variable, label] : labels)
      proposal.emplace_back(variable.index, static_cast<std::size_t>(place(variable, label)));
    graph_.propose(std::move(proposal));
  }
  void solve() { solution_ = graph_.solve(); }

  CandidateLabel label_of(const Variable& variable) const {
    CandidateLabel result;
    result.label = variable.labels[solution_.labels[variable.index]];
    const Eigen::ArrayXd unary = unary_[variable.index].array() - unary_[variable.index].maxCoeff();
    const Eigen::ArrayXd likelihood = unary.exp() / unary.exp().sum();
    for (std::size_t i = 0; i < variable.labels.size(); ++i) {
      const auto label = static_cast<std::size_t>(variable.labels[i]);
      result.likelihood[label] = likelihood(static_cast<Eigen::Index>(i));
      result.belief[label] = solution_.beliefs[variable.index](static_cast<Eigen::Index>(i));
    }
    return result;
  }

 private:
  static Eigen::Index place(const Variable& variable, EntityLabel label) {
    return std::find(variable.labels.begin(), variable.labels.end(), label) - variable.labels.begin();
  }
  FactorGraph graph_;
  std::vector<Eigen::VectorXd> unary_;
  FactorGraph::Solution solution_;
};

double angle_between(const WallCandidate& a, const WallCandidate& b) {
  return std::abs(std::remainder(a.yaw() - b.yaw(), EIGEN_PI));  // 0 .. pi/2
}

double distance(const WallCandidate& a, const WallCandidate& b) {
  return std::min({(a.start - b.start).norm(), (a.start - b.end).norm(), (a.end - b.start).norm(),
                   (a.end - b.end).norm()});
}

/// Whether a straight wall goes on as the round one that a facet belongs to: the facet lies at its end, and
/// the round wall's facets lie along less than half of it.
bool goes_on_round(const std::vector<WallCandidate>& walls, const WallCandidate& straight,
                   const WallCandidate& facet) {
  const auto at = [&](const Eigen::Vector2d& end) {
    return (nearest_on_segment(end, facet.start, facet.end) - end).norm() < facet.length();
  };
  if (!at(straight.start) && !at(straight.end)) return false;
  double along = 0;
  for (const WallCandidate& other : walls)
    along += other.curve == facet.curve && same_place(straight, other) ? other.length() : 0;
  return along < 0.5 * straight.length();
}

/// Whether a wall is a short surface in the place of a longer one: furniture along it, or the same wall
/// again. A round wall may go on where a straight one ends: there the straight one counts.
bool repeats_longer(const std::vector<WallCandidate>& walls, const WallCandidate& wall) {
  return std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& other) {
    if (other.score <= 0 || !same_place(wall, other)) return false;
    const bool straight = wall.curve == kNoCurve, other_straight = other.curve == kNoCurve;
    if (straight && !other_straight && goes_on_round(walls, wall, other)) return false;
    if (!straight && other_straight && goes_on_round(walls, other, wall)) return true;
    return other.whole_length() > wall.whole_length();
  });
}

void relate_walls(Net& net, const std::vector<Variable>& variables, const std::vector<WallCandidate>& walls) {
  constexpr std::size_t kNeighbours = 4;  // of each wall: those at its corners and the opposite one
  constexpr double kFarthest = 8;         // m
  constexpr double kSquare = 0.035;       // rad, 2 degrees
  std::set<std::pair<std::size_t, std::size_t>> related;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t j = 0; j < walls.size(); ++j) {
      if (j == i) continue;
      if (j > i && same_place(walls[i], walls[j]))
        net.relate(variables[i], EntityLabel::wall, variables[j], EntityLabel::wall, kTwice);
      if (walls[j].score < 0 || distance(walls[i], walls[j]) > kFarthest) continue;
      const double angle = angle_between(walls[i], walls[j]);
      if (angle > kSquare && std::abs(angle - EIGEN_PI / 2) > kSquare) continue;
      near.emplace_back(distance(walls[i], walls[j]), j);
    }
    std::sort(near.begin(), near.end());
    for (std::size_t k = 0; k < std::min(near.size(), kNeighbours); ++k) {
      const std::size_t j = near[k].second;
      if (!related.emplace(std::min(i, j), std::max(i, j)).second) continue;
      net.relate(variables[i], EntityLabel::wall, variables[j], EntityLabel::wall, kAtRightAngles);
    }
  }
}

/// A hole through a thick wall is one door or one window, not one per face.
void relate_holes(Net& net, const std::vector<Variable>& variables, const WallCandidates& candidates) {
  const std::vector<Opening>& openings = candidates.openings;
  for (std::size_t i = 0; i < openings.size(); ++i) {
    for (std::size_t j = i + 1; j < openings.size(); ++j) {
      const std::size_t a = openings[i].wall, b = openings[j].wall;
      if (a == b || !same_hole(openings[i], candidates.walls[a], openings[j], candidates.walls[b])) continue;
      for (const EntityLabel one : {EntityLabel::door, EntityLabel::window}) {
        for (const EntityLabel other : {EntityLabel::door, EntityLabel::window})
          net.relate(variables[i], one, variables[j], other, kTwice);
      }
    }
  }
}

/// Each likely wall with its openings, in place of other walls there: of one with many doors no single label
/// is better alone.
void propose_walls(Net& net, const std::vector<Variable>& walls, const std::vector<Variable>& openings,
                   const WallCandidates& candidates) {
  const auto best_of = [](const Opening& opening) {
    if (std::max(opening.door_score, opening.window_score) <= 0) return EntityLabel::unknown;
    return opening.door_score >= opening.window_score ? EntityLabel::door : EntityLabel::window;
  };
  for (std::size_t w = 0; w < walls.size(); ++w) {
    if (candidates.walls[w].score <= 0) continue;
    std::vector<std::pair<Variable, EntityLabel>> labels;
    std::vector<bool> instead(walls.size());
    for (std::size_t other = 0; other < walls.size(); ++other) {
      instead[other] = other != w && same_place(candidates.walls[w], candidates.walls[other]);
      if (instead[other]) labels.emplace_back(walls[other], EntityLabel::unknown);
    }
    labels.emplace_back(walls[w], EntityLabel::wall);
    bool any = false;
    for (std::size_t o = 0; o < openings.size(); ++o) {
      const Opening& opening = candidates.openings[o];
      if (instead[opening.wall]) labels.emplace_back(openings[o], EntityLabel::unknown);
      if (opening.wall == w) labels.emplace_back(openings[o], best_of(opening));
      any = any || opening.wall == w;
    }
    if (any) net.propose(labels);
  }
}

/// Whether a slender object is in an opening: the leaf of a door, seen from its edge or ajar.
bool stands_in(const PillarCandidate& pillar, const Opening& opening, const WallCandidate& around) {
  constexpr double kBefore = 0.15, kBehind = 0.5;  // m
  const Eigen::Vector2d along = (around.end - around.start).normalized();
  const Eigen::Vector2d p = 0.5 * (pillar.low + pillar.high) - around.start;
  const double at = along.dot(p), depth = around.raster.away.dot(p);
  return at > opening.from && at < opening.to && depth > -kBefore && depth < kBehind;
}

/// Whether `wall` closes the opening: the leaf of a recessed door.
bool closes(const WallCandidate& wall, const Opening& opening, const WallCandidate& around) {
  if (opening.closed <= 0.35 || angle_between(wall, around) > 0.17) return false;
  const Eigen::Vector2d along = (around.end - around.start).normalized();
  const Eigen::Vector2d middle = 0.5 * (wall.start + wall.end) - around.start;
  const double at = along.dot(middle), depth = around.raster.away.dot(middle);
  return at > opening.from && at < opening.to && std::abs(depth - opening.recess) < 0.12 &&
         wall.length() < opening.width() + 0.4;
}

void relate_levels(Net& net, const std::vector<Variable>& walls, const std::vector<Variable>& horizontals,
                   const NetCandidates& candidates) {
  constexpr double kSame = 0.12;  // m, between a wall's foot and its floor
  const std::vector<HorizontalSurface>& surfaces = candidates.segmentation.horizontals;
  // The largest surface at a height among those that extend close to the wall.
  const auto level_at = [&](double z) {
    std::size_t best = surfaces.size();
    for (std::size_t h = 0; h < surfaces.size(); ++h) {
      if (std::abs(surfaces[h].z - z) < kSame &&
          (best == surfaces.size() || surfaces[h].area > surfaces[best].area))
        best = h;
    }
    return best;
  };
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const WallCandidate& wall = candidates.walls.walls[w];
    const std::size_t under = level_at(wall.floor), over = level_at(wall.ceiling);
    if (under < surfaces.size() && wall.z_low - wall.floor < 0.4)
      net.relate(walls[w], EntityLabel::wall, horizontals[under], EntityLabel::floor, kOnLevel);
    if (over < surfaces.size() && wall.ceiling - wall.z_high < 0.4)
      net.relate(walls[w], EntityLabel::wall, horizontals[over], EntityLabel::ceiling, kOnLevel);
  }
}

/// The treads of long even flights: however wide, they are no floors. The last one is the landing.
std::set<std::uint32_t> treads_of(const std::vector<Flight>& flights) {
  constexpr std::size_t kLong = 5;  // levels
  std::set<std::uint32_t> treads;
  for (const Flight& flight : flights) {
    for (std::size_t i = 1; i + 1 < flight.steps.size() && flight.steps.size() >= kLong; ++i)
      treads.insert(flight.steps[i].horizontal);
  }
  return treads;
}

/// A variable for each opening; doors and windows need their wall.
std::vector<Variable> add_openings(Net& net, const std::vector<Variable>& walls,
                                   const std::vector<Opening>& candidates) {
  std::vector<Variable> openings;
  for (const Opening& opening : candidates) {
    openings.push_back(net.add({{EntityLabel::unknown, 0},
                                {EntityLabel::door, opening.door_score},
                                {EntityLabel::window, opening.window_score}}));
    for (const EntityLabel label : {EntityLabel::door, EntityLabel::window})
      net.relate(openings.back(), label, walls[opening.wall], EntityLabel::unknown, kInNoWall);
    // The label of an opening does not support its wall: a railing has many openings.
    const double all = std::log(1 + std::exp(opening.door_score) + std::exp(opening.window_score));
    for (const EntityLabel label : openings.back().labels)
      net.relate(openings.back(), label, walls[opening.wall], EntityLabel::wall, -all);
  }
  return openings;
}

/// A variable for each step of a flight; steps support each other, and take the labels of their treads.
std::vector<Variable> add_flight(Net& net, const Flight& flight, const std::vector<Variable>& horizontals) {
  std::vector<Variable> steps;
  std::vector<std::pair<Variable, EntityLabel>> climbs;
  const double each = flight.score / static_cast<double>(flight.steps.size());
  for (std::size_t i = 0; i < flight.steps.size(); ++i) {
    steps.push_back(net.add({{EntityLabel::unknown, 0}, {EntityLabel::stairs, each}}));
    const std::uint32_t tread = flight.steps[i].horizontal;
    climbs.emplace_back(steps[i], EntityLabel::stairs);
    if (i > 0 && i + 1 < flight.steps.size() && tread != kNoSurface) {
      climbs.emplace_back(horizontals[tread], EntityLabel::unknown);
      net.relate(steps[i], EntityLabel::stairs, horizontals[tread], EntityLabel::floor, kTreadAndFloor);
    }
    if (i == 0) continue;
    net.relate(steps[i - 1], EntityLabel::stairs, steps[i], EntityLabel::stairs, kNextStep);
    net.relate(steps[i - 1], EntityLabel::stairs, steps[i], EntityLabel::unknown, -kNextStep);
    net.relate(steps[i - 1], EntityLabel::unknown, steps[i], EntityLabel::stairs, -kNextStep);
  }
  net.propose(climbs);
  return steps;
}

/// A door is not closed by another wall, unless that is its leaf, nor by a pillar.
void relate_openings(Net& net, const std::vector<Variable>& openings, const std::vector<Variable>& walls,
                     const std::vector<Variable>& pillars, const NetCandidates& candidates) {
  for (std::size_t o = 0; o < openings.size(); ++o) {
    const Opening& opening = candidates.walls.openings[o];
    for (std::size_t w = 0; w < walls.size(); ++w) {
      if (w == opening.wall ||
          !closes(candidates.walls.walls[w], opening, candidates.walls.walls[opening.wall]))
        continue;
      net.relate(openings[o], EntityLabel::door, walls[w], EntityLabel::wall, kTwice);
      net.relate(openings[o], EntityLabel::door, walls[w], EntityLabel::unknown, kLeaf);
    }
    for (std::size_t p = 0; p < pillars.size(); ++p) {
      if (stands_in(candidates.pillars[p], opening, candidates.walls.walls[opening.wall]))
        net.relate(openings[o], EntityLabel::door, pillars[p], EntityLabel::pillar, kTwice);
    }
  }
}

}  // namespace

bool same_place(const WallCandidate& a, const WallCandidate& b) {
  if (angle_between(a, b) > 0.17 || !on_same_storey(a, b)) return false;
  const WallCandidate &longer = a.length() > b.length() ? a : b, &shorter = a.length() > b.length() ? b : a;
  const Eigen::Vector2d along = (longer.end - longer.start).normalized();
  const Eigen::Vector2d p = shorter.start - longer.start, q = shorter.end - longer.start;
  const auto across = [&](const Eigen::Vector2d& d) {
    return std::abs(along.x() * d.y() - along.y() * d.x());
  };
  if (0.5 * (across(p) + across(q)) > 0.15) return false;
  const double from = std::min(along.dot(p), along.dot(q)), to = std::max(along.dot(p), along.dot(q));
  return std::min(to, longer.length()) - std::max(from, 0.0) > 0.4 * shorter.length();
}

std::optional<BackFace> back_face(const WallCandidate& front, const WallCandidate& back) {
  constexpr double kParallel = 0.06, kThinnest = 0.03, kThinnestUnplaced = 0.06;  // rad, m, m
  const bool flat = front.curve == kNoCurve && back.curve == kNoCurve;
  if (!flat || back.score <= 0 || angle_between(front, back) > kParallel || !same_place(front, back))
    return std::nullopt;
  const Eigen::Vector2d along = (front.end - front.start).normalized();
  const auto [from, to] =
      std::minmax({along.dot(back.start - front.start), along.dot(back.end - front.start)});
  const double depth = front.raster.away.dot(0.5 * (back.start + back.end) - front.start);
  // What stands before a wall is seen from the wall's own side, its other face is not.
  const bool placed = front.raster.viewpoints_known && back.raster.viewpoints_known;
  if (placed && (depth < kThinnest || front.raster.away.dot(back.raster.away) > -0.5)) return std::nullopt;
  if (std::abs(depth) < kThinnestUnplaced && !placed) return std::nullopt;
  return BackFace{depth, from, to};
}

Labelling assign_labels(const NetCandidates& candidates) {
  Net net;
  std::vector<Variable> walls, openings, horizontals, pillars;
  std::vector<std::vector<Variable>> flights;
  const auto repeats = [&](const WallCandidate& wall) {
    return repeats_longer(candidates.walls.walls, wall) ? kRepeats : 0.0;
  };
  for (const WallCandidate& wall : candidates.walls.walls)
    walls.push_back(net.add({{EntityLabel::unknown, 0}, {EntityLabel::wall, wall.score - repeats(wall)}}));
  openings = add_openings(net, walls, candidates.walls.openings);
  const std::set<std::uint32_t> treads = treads_of(candidates.flights);
  for (std::uint32_t h = 0; h < candidates.segmentation.horizontals.size(); ++h) {
    const double tread = treads.contains(h) ? kTreadOfFlight : 0;
    horizontals.push_back(net.add({{EntityLabel::unknown, 0},
                                   {EntityLabel::floor, candidates.levels.floor_score(h) + tread},
                                   {EntityLabel::ceiling, candidates.levels.ceiling_score(h)}}));
  }
  for (const PillarCandidate& pillar : candidates.pillars)
    pillars.push_back(net.add({{EntityLabel::unknown, 0}, {EntityLabel::pillar, pillar.score}}));
  for (const Flight& flight : candidates.flights) flights.push_back(add_flight(net, flight, horizontals));
  relate_openings(net, openings, walls, pillars, candidates);
  relate_holes(net, openings, candidates.walls);
  relate_walls(net, walls, candidates.walls.walls);
  propose_walls(net, walls, openings, candidates.walls);
  relate_levels(net, walls, horizontals, candidates);
  net.solve();

  Labelling labelling;
  const auto read = [&](const std::vector<Variable>& variables, std::vector<CandidateLabel>& labels) {
    for (const Variable& variable : variables) labels.push_back(net.label_of(variable));
  };
  read(walls, labelling.walls);
  read(openings, labelling.openings);
  read(horizontals, labelling.horizontals);
  read(pillars, labelling.pillars);
  for (const auto& steps : flights) read(steps, labelling.steps.emplace_back());
  return labelling;
}

}  // namespace parhelion::semantic

#include "fusion/semantic/net/net_entities.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "fusion/semantic/net/wall_cuts.hpp"
#include "fusion/semantic/net/wall_support.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kThinnest = 0.04;  ///< m, of a wall's box, centred at its face if only one was measured
constexpr double kLeaf = 0.04;      ///< m, of a door
constexpr double kShortest = 0.05;  ///< m, of a piece of a wall

double round_millimetre(double v) { return std::round(v * 1000) / 1000; }

class Entities {
 public:
  Entities(const NetCandidates& candidates, const Labelling& labelling)
      : candidates_(candidates), labelling_(labelling) {
    for (std::size_t f = 0; f < candidates.flights.size(); ++f) {
      if (labelling.is_flight(f)) flights_.push_back(&candidates.flights[f]);
    }
  }

  SemanticNet take() {
    add_levels(EntityLabel::floor, "floor");
    add_levels(EntityLabel::ceiling, "ceiling");
    for (std::size_t w = 0; w < candidates_.walls.walls.size(); ++w) {
      if (labelling_.walls[w].label == EntityLabel::wall) add_wall(w);
    }
    add_pillars();
    add_flights();
    relate_walls(candidates_, labelling_, whole_walls_, net_);
    relate_levels(candidates_, whole_walls_, net_);
    for (LabelEvidence& evidence : net_.evidence) {
      for (const Relation& relation : net_.relations) {
        if (relation.from == evidence.entity || relation.to == evidence.entity)
          evidence.supports.push_back(relation);
      }
    }
    return std::move(net_);
  }

 private:
  ModelEntity& add(const std::string& name, const CandidateLabel& label, EntityLabel as,
                   const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size) {
    ModelEntity entity;
    entity.name = name;
    entity.label = as;
    entity.T_map_body = T_map_body;
    entity.size = size.unaryExpr(&round_millimetre);
    entity.confidence = std::clamp(label.confidence(), 0.0, 1.0);
    net_.entities.push_back(entity);
    net_.evidence.push_back({name, label.likelihood, label.belief, {}});
    return net_.entities.back();
  }
  void relate(RelationKind kind, const std::string& from, const std::string& to, double confidence) {
    net_.relations.push_back({kind, from, to, confidence});
  }
  std::string numbered(const std::string& word) { return word + " " + std::to_string(++count_[word]); }

  void add_levels(EntityLabel label, const std::string& word);
  struct WallName {
    std::string name;
    int pieces = 0;
    bool whole = false;  ///< one stretch: without openings it is one piece
  };
  void add_wall(std::size_t w);
  void add_stretch(std::size_t w, const WallStretch& stretch, WallName& named);
  std::vector<WallStretch> stretches_of(std::size_t w) const;
  /// The other face of a wall behind most of a stretch of it.
  std::optional<BackFace> behind(std::size_t w, double from, double to) const;
  std::string add_piece(std::size_t w, const CandidateLabel& label, const std::string& name, EntityLabel as,
                        double from, double to, double low, double high);
  void add_door(std::size_t w, std::size_t opening, const std::string& wall_name, const std::string& piece,
                double top);
  void add_pillars();
  void add_flights();

  const NetCandidates& candidates_;
  const Labelling& labelling_;
  std::vector<const Flight*> flights_;  ///< flights labelled stairs
  SemanticNet net_;
  std::map<std::string, int> count_;
  std::map<std::uint32_t, std::pair<std::string, int>> round_;  ///< by curve: name, pieces so far
  WholeWalls whole_walls_;                                      ///< name of the first piece, candidate
};

void Entities::add_levels(EntityLabel label, const std::string& word) {
  struct Level {
    double z_area = 0, area = 0;
    Eigen::Vector2d low, high;
    CandidateLabel best;
  };
  std::vector<Level> levels;
  for (std::size_t h = 0; h < labelling_.horizontals.size(); ++h) {
    if (labelling_.horizontals[h].label != label) continue;
    const HorizontalSurface& surface = candidates_.segmentation.horizontals[h];
    const auto same = [&](const Level& level) {
      return std::abs(level.z_area / level.area - surface.z) < kSameLevel;
    };
    auto level = std::find_if(levels.begin(), levels.end(), same);
    if (level == levels.end()) {
      levels.push_back(
          {surface.z * surface.area, surface.area, surface.low, surface.high, labelling_.horizontals[h]});
      continue;
    }
    if (labelling_.horizontals[h].confidence() > level->best.confidence())
      level->best = labelling_.horizontals[h];
    level->z_area += surface.z * surface.area;
    level->area += surface.area;
    level->low = level->low.cwiseMin(surface.low), level->high = level->high.cwiseMax(surface.high);
  }
  std::stable_sort(levels.begin(), levels.end(),
                   [](const Level& a, const Level& b) { return a.area > b.area; });
  for (const Level& level : levels) {
    const double z = level.z_area / level.area;
    const Eigen::Vector2d centre = 0.5 * (level.low + level.high), size = level.high - level.low;
    const double middle = label == EntityLabel::floor ? z - kSlab / 2 : z + kSlab / 2;
    add(numbered(word), level.best, label, Transform<Map, Body>::planar(centre.x(), centre.y(), 0, middle),
        {size.x(), size.y(), kSlab})
        .observed = std::min(1.0, level.area / std::max(size.prod(), 1e-6));
  }
}

std::optional<BackFace> Entities::behind(std::size_t w, double from, double to) const {
  const std::vector<WallCandidate>& walls = candidates_.walls.walls;
  for (std::size_t other = 0; other < walls.size(); ++other) {
    if (labelling_.walls[other].label == EntityLabel::wall) continue;
    const auto back = back_face(walls[w], walls[other]);
    if (back && std::min(to, back->to) - std::max(from, back->from) > 0.5 * (to - from)) return back;
  }
  return std::nullopt;
}

std::string Entities::add_piece(std::size_t w, const CandidateLabel& label, const std::string& name,
                                EntityLabel as, double from, double to, double low, double high) {
  if (to - from < kShortest || high - low < kShortest) return "";
  const WallCandidate& wall = candidates_.walls.walls[w];
  const Eigen::Vector2d along = (wall.end - wall.start).normalized();
  const double thickness = std::clamp(wall.thickness, kThinnest, 0.10);
  const auto back = behind(w, from, to);
  const double depth = back ? back->depth : 0;
  const Eigen::Vector2d centre = wall.start + 0.5 * (from + to) * along + 0.5 * depth * wall.raster.away;
  ModelEntity& piece = add(
      name, label, as, Transform<Map, Body>::planar(centre.x(), centre.y(), wall.yaw(), 0.5 * (low + high)),
      {to - from, thickness + std::abs(depth), high - low});
  const WallRaster::Fractions seen = wall.raster.fractions(
      static_cast<int>(from / wall.raster.column), static_cast<int>(to / wall.raster.column), low, high);
  piece.observed = std::clamp(seen.measured + seen.behind + seen.through, 0.0, 1.0);
  return name;
}

void Entities::add_door(std::size_t w, std::size_t o, const std::string& wall_name, const std::string& piece,
                        double top) {
  const WallCandidate& wall = candidates_.walls.walls[w];
  const Opening& opening = candidates_.walls.openings[o];
  const CandidateLabel& label = labelling_.openings[o];
  const Eigen::Vector2d along = (wall.end - wall.start).normalized();
  const Eigen::Vector2d centre = wall.start + 0.5 * (opening.from + opening.to) * along;
  const double height = opening.head - wall.floor, z = wall.floor + height / 2;
  const std::string number = std::to_string(++count_["door"]);
  const std::string space = "free space of door " + number;
  add(space, label, EntityLabel::free_space,
      Transform<Map, Body>::planar(centre.x(), centre.y(), wall.yaw(), z),
      {opening.width(), std::max(2 * opening.recess + 0.1, 0.3), height})
      .part_of = wall_name;
  relate(RelationKind::available_inside, space, piece, label.confidence());
  const Eigen::Vector2d leaf = centre + opening.recess * wall.raster.away;
  ModelEntity& door =
      add("door " + number, label, EntityLabel::door,
          Transform<Map, Body>::planar(leaf.x(), leaf.y(), wall.yaw(), z), {opening.width(), kLeaf, height});
  door.part_of = wall_name;
  door.observed = opening.closed;
  Hinge hinge;
  hinge.axis = {-opening.width() / 2, 0};
  if (opening.closed < 0.35) {
    // The leaf was not seen: it is drawn open by a quarter turn to the far side, out of the way.
    const double side = wall.raster.away.x() * -along.y() + wall.raster.away.y() * along.x() > 0 ? 1 : -1;
    const Eigen::Vector2d hung = wall.start + opening.from * along;
    const Eigen::Vector2d open = hung + 0.5 * opening.width() * wall.raster.away;
    door.T_map_body = Transform<Map, Body>::planar(open.x(), open.y(), wall.yaw() + side * EIGEN_PI / 2, z);
    hinge.lower = side > 0 ? -EIGEN_PI / 2 : 0;
    hinge.upper = side > 0 ? 0 : EIGEN_PI / 2;
    hinge.closed = side > 0 ? hinge.lower : hinge.upper;
  }
  door.hinge = hinge;
  relate(RelationKind::available_inside, door.name, piece, label.confidence());
  relate(RelationKind::connected_via_joint, door.name, piece, label.confidence());
  const std::string above = "wall above door " + number;
  if (!add_piece(w, label, above, EntityLabel::wall_above_door, opening.from, opening.to, opening.head, top)
           .empty()) {
    net_.entities.back().part_of = wall_name;
    relate(RelationKind::above, above, "door " + number, label.confidence());
    relate(RelationKind::under, "door " + number, above, label.confidence());
  }
}

/// The stretches of a wall that are drawn: supported, and no riser of a flight.
std::vector<WallStretch> Entities::stretches_of(std::size_t w) const {
  const WallCandidate& wall = candidates_.walls.walls[w];
  const WallStretch all = without_risers(wall, flights_);
  if (wall.curve != kNoCurve) return {all};
  std::vector<Opening> kept;
  for (std::size_t o = 0; o < candidates_.walls.openings.size(); ++o) {
    const Opening& opening = candidates_.walls.openings[o];
    if (opening.wall == w && (labelling_.openings[o].label != EntityLabel::unknown || opening.lintel > 0.4))
      kept.push_back(opening);
  }
  std::vector<WallStretch> stretches;
  for (const WallStretch& stretch : supported_stretches(wall, kept)) {
    const WallStretch part{std::max(stretch.from, all.from), std::min(stretch.to, all.to)};
    if (part.to - part.from >= kShortest) stretches.push_back(part);
  }
  return stretches;
}

void Entities::add_wall(std::size_t w) {
  const WallCandidate& wall = candidates_.walls.walls[w];
  const std::vector<WallStretch> stretches = stretches_of(w);
  if (stretches.empty()) return;
  const bool round = wall.curve != kNoCurve;
  if (round && round_.count(wall.curve) == 0) round_[wall.curve] = {numbered("wall"), 0};
  WallName name{round ? round_[wall.curve].first : numbered("wall"), 0, stretches.size() == 1 && !round};
  if (round) name.pieces = round_[wall.curve].second;
  for (const WallStretch& stretch : stretches) add_stretch(w, stretch, name);
  if (round) round_[wall.curve].second = name.pieces;
}

/// The pieces of one stretch and its openings.
void Entities::add_stretch(std::size_t w, const WallStretch& stretch, WallName& named) {
  const WallCandidate& wall = candidates_.walls.walls[w];
  const CandidateLabel& label = labelling_.walls[w];
  const std::string& name = named.name;
  const double top = top_of(candidates_, labelling_, w);
  const std::vector<std::size_t> cuts = openings_that_cut(candidates_, labelling_, w, stretch);
  std::vector<std::string> pieces(cuts.size() + 1);
  const bool whole = cuts.empty() && named.whole;
  const auto piece_name = [&] { return whole ? name : name + "." + std::to_string(++named.pieces); };
  double from = stretch.from;
  for (std::size_t k = 0; k <= cuts.size(); ++k) {
    const double to = k < cuts.size() ? candidates_.walls.openings[cuts[k]].from : stretch.to;
    pieces[k] = add_piece(w, label, piece_name(), EntityLabel::wall, from, to, wall.floor, top);
    if (!pieces[k].empty() && !whole) net_.entities.back().part_of = name;
    if (!pieces[k].empty() && (whole_walls_.empty() || whole_walls_.back().second != w))
      whole_walls_.emplace_back(pieces[k], w);
    if (k < cuts.size()) from = candidates_.walls.openings[cuts[k]].to;
  }
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    const Opening& opening = candidates_.walls.openings[cuts[k]];
    const std::string& beside = pieces[k].empty() ? pieces[k + 1] : pieces[k];
    if (labelling_.openings[cuts[k]].label == EntityLabel::door && !beside.empty()) {
      add_door(w, cuts[k], name, beside, top);
    } else if (labelling_.openings[cuts[k]].label == EntityLabel::window && !beside.empty()) {
      const std::string window = numbered("window");
      add_piece(w, labelling_.openings[cuts[k]], window, EntityLabel::window, opening.from, opening.to,
                opening.sill, opening.head);
      net_.entities.back().part_of = name;
      relate(RelationKind::available_inside, window, beside, labelling_.openings[cuts[k]].confidence());
      add_piece(w, label, piece_name(), EntityLabel::wall, opening.from, opening.to, wall.floor,
                opening.sill);
      add_piece(w, label, piece_name(), EntityLabel::wall, opening.from, opening.to, opening.head, top);
    } else {
      add_piece(w, label, piece_name(), EntityLabel::wall, opening.from, opening.to, opening.head, top);
    }
  }
}

void Entities::add_pillars() {
  for (std::size_t i = 0; i < candidates_.pillars.size(); ++i) {
    if (labelling_.pillars[i].label != EntityLabel::pillar) continue;
    const PillarCandidate& pillar = candidates_.pillars[i];
    const Eigen::Vector2d centre = 0.5 * (pillar.low + pillar.high);
    const Eigen::Vector2d size = (pillar.high - pillar.low).cwiseMax(0.05);
    add(numbered("pillar"), labelling_.pillars[i], EntityLabel::pillar,
        Transform<Map, Body>::planar(centre.x(), centre.y(), 0, 0.5 * (pillar.floor + pillar.top)),
        {size.x(), size.y(), pillar.top - pillar.floor});
  }
}

void Entities::add_flights() {
  for (std::size_t f = 0; f < candidates_.flights.size(); ++f) {
    const Flight& flight = candidates_.flights[f];
    if (!labelling_.is_flight(f)) continue;
    const auto& labels = labelling_.steps[f];
    StairsFlight summary;
    summary.name = numbered("stairs");
    summary.rises = flight.rises();
    summary.treads = flight.treads();
    summary.confidence = 1;
    const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
    const double yaw = std::atan2(flight.direction.y(), flight.direction.x()), foot = flight.steps.front().z;
    std::vector<double> treads = summary.treads;
    std::sort(treads.begin(), treads.end());
    std::string before;
    for (std::size_t i = 1; i < flight.steps.size(); ++i) {
      const Step& step = flight.steps[i];
      summary.confidence = std::min(summary.confidence, labels[i].confidence());
      // The space under a tread is not passable: each step is solid from the foot of the flight. The last one
      // is the landing, a floor of its own: its step ends where the others' do.
      const double far = i + 1 < flight.steps.size()
                             ? std::max(flight.steps[i + 1].near, step.near + 0.05)
                             : std::min(step.far, step.near + treads[treads.size() / 2]);
      const Eigen::Vector2d centre =
          0.5 * (step.near + far) * flight.direction + 0.5 * (step.left + step.right) * across;
      const std::string name = summary.name + " step " + std::to_string(i);
      add(name, labels[i], EntityLabel::stairs,
          Transform<Map, Body>::planar(centre.x(), centre.y(), yaw, 0.5 * (foot + step.z)),
          {far - step.near, step.right - step.left, step.z - foot})
          .part_of = summary.name;
      if (!before.empty()) {
        for (const RelationKind kind : {RelationKind::above, RelationKind::parallel})
          relate(kind, name, before, labels[i].confidence());
        relate(RelationKind::under, before, name, labels[i].confidence());
      }
      before = name;
    }
    net_.stairs.push_back(summary);
  }
}

}  // namespace

SemanticNet entities_of(const NetCandidates& candidates, const Labelling& labelling) {
  return Entities(candidates, labelling).take();
}

}  // namespace parhelion::semantic

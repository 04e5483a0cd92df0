// Relations between whole walls, and between walls and the levels at their lower and upper ends.
#include <cmath>

#include "fusion/semantic/net/net_entities.hpp"

namespace parhelion::semantic {

void relate_walls(const NetCandidates& candidates, const Labelling& labelling, const WholeWalls& whole_walls,
                  SemanticNet& net) {
  const auto relate = [&](RelationKind kind, const std::string& from, const std::string& to,
                          double confidence) {
    net.relations.push_back({kind, from, to, confidence});
  };
  constexpr double kFarthest = 8, kSquare = 0.035, kEqual = 0.05;  // m, rad, m
  for (std::size_t i = 0; i < whole_walls.size(); ++i) {
    const WallCandidate& a = candidates.walls.walls[whole_walls[i].second];
    for (std::size_t j = i + 1; j < whole_walls.size(); ++j) {
      const WallCandidate& b = candidates.walls.walls[whole_walls[j].second];
      if ((0.5 * (a.start + a.end) - 0.5 * (b.start + b.end)).norm() >
          kFarthest + 0.5 * (a.length() + b.length()))
        continue;
      const double angle = std::abs(std::remainder(a.yaw() - b.yaw(), EIGEN_PI));
      const double confidence = std::min(labelling.walls[whole_walls[i].second].confidence(),
                                         labelling.walls[whole_walls[j].second].confidence());
      const std::string &from = whole_walls[i].first, &to = whole_walls[j].first;
      if (angle < kSquare) relate(RelationKind::parallel, from, to, confidence);
      if (std::abs(angle - EIGEN_PI / 2) < kSquare) relate(RelationKind::orthogonal, from, to, confidence);
      if (std::abs(a.ceiling - b.ceiling) < kEqual) relate(RelationKind::equal_height, from, to, confidence);
    }
  }
}

void relate_levels(const NetCandidates& candidates, const WholeWalls& whole_walls, SemanticNet& net) {
  std::vector<Relation> found;
  for (const ModelEntity& level : net.entities) {
    if (level.label != EntityLabel::floor && level.label != EntityLabel::ceiling) continue;
    const double z = level.T_map_body.translation().z();
    for (const auto& [name, w] : whole_walls) {
      const WallCandidate& wall = candidates.walls.walls[w];
      const bool floor = level.label == EntityLabel::floor;
      if (std::abs(z + (floor ? kSlab : -kSlab) / 2 - (floor ? wall.floor : wall.ceiling)) > kSameLevel)
        continue;
      found.push_back(
          {floor ? RelationKind::under : RelationKind::above, level.name, name, level.confidence});
    }
  }
  net.relations.insert(net.relations.end(), found.begin(), found.end());
}

}  // namespace parhelion::semantic

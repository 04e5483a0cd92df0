// Builds a joint labelling from candidates, and entities with relations from it. Internal to the semantic
// net.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "fusion/semantic/net/find_pillars.hpp"
#include "fusion/semantic/net/find_stairs.hpp"
#include "fusion/semantic/net/levels.hpp"
#include "fusion/semantic/net/semantic_net.hpp"
#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

struct NetCandidates {
  const Segmentation& segmentation;
  const Levels& levels;
  WallCandidates walls;
  std::vector<PillarCandidate> pillars;
  std::vector<Flight> flights;
};

/// The label of one candidate, before and after the influence of its neighbours.
struct CandidateLabel {
  EntityLabel label = EntityLabel::unknown;
  std::array<double, kEntityLabels> likelihood{}, belief{};
  double confidence() const { return belief[static_cast<std::size_t>(label)]; }
};

struct Labelling {
  std::vector<CandidateLabel> walls;               ///< wall or unknown
  std::vector<CandidateLabel> openings;            ///< door, window or unknown (a gap)
  std::vector<CandidateLabel> horizontals;         ///< floor, ceiling, stairs or unknown
  std::vector<CandidateLabel> pillars;             ///< pillar or unknown
  std::vector<std::vector<CandidateLabel>> steps;  ///< per flight and step: stairs or unknown

  /// Whether all of its steps are labelled stairs.
  bool is_flight(std::size_t f) const {
    return std::all_of(steps[f].begin(), steps[f].end(),
                       [](const CandidateLabel& step) { return step.label == EntityLabel::stairs; });
  }
};

Labelling assign_labels(const NetCandidates& candidates);

SemanticNet entities_of(const NetCandidates& candidates, const Labelling& labelling);

inline constexpr double kSlab = 0.10;       ///< m, of a floor or a ceiling
inline constexpr double kSameLevel = 0.08;  ///< m, surfaces of one floor

/// Per wall: the name of its first piece, and the index of its candidate.
using WholeWalls = std::vector<std::pair<std::string, std::size_t>>;

/// Add the relations parallel, orthogonal and equal height; under (a floor) and above (a ceiling) a wall.
void relate_walls(const NetCandidates& candidates, const Labelling& labelling, const WholeWalls& whole_walls,
                  SemanticNet& net);
void relate_levels(const NetCandidates& candidates, const WholeWalls& whole_walls, SemanticNet& net);

/// Fills net.labels: an EntityLabel for each point.
void label_points(const cloud::PointCloud<Map>& cloud, const NetCandidates& candidates,
                  const Labelling& labelling, SemanticNet& net);

}  // namespace parhelion::semantic

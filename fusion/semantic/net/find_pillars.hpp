// Finds slender objects that reach from the floor to above a person's head. Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/levels.hpp"
#include "fusion/semantic/net/wall_candidates.hpp"

namespace parhelion::semantic {

struct PillarCandidate {
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Zero();  ///< m, bounds in the plan
  double floor = 0, top = 0;                                                      ///< m
  double score = 0;  ///< log odds of a pillar against an unknown object
};

std::vector<PillarCandidate> find_pillars(const PlanPoints& points, const WallCandidates& walls,
                                          const Levels& levels);

}  // namespace parhelion::semantic

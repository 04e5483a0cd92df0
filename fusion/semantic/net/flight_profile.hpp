// The stepped profile of a flight, looked at from its side: what continues it needs few points, because where
// its risers and treads must be is known. Internal to the semantic net.
#pragma once

#include <optional>

#include "fusion/semantic/net/find_stairs.hpp"

namespace parhelion::semantic {

/// The flight's direction, turned until its risers are square to it; unchanged where too little of them is
/// seen.
Eigen::Vector2d square_to_risers(const PlanBlocks& points, const Flight& flight);

/// The step that continues the flight's profile beyond one end, there or behind a landing; the end's own step
/// is changed where it is that landing.
std::optional<Step> next_on_profile(const PlanBlocks& points, Flight& flight, bool below);

}  // namespace parhelion::semantic

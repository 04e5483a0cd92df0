// A door on its hinge: pose of the leaf at an opening angle.
#pragma once

#include "protocols/model.hpp"

namespace parhelion {

/// The hinge of a door of the model. Where the model gives none: at the left end of the box, closed as drawn,
/// and swinging a quarter turn to both sides, as the opening side is unknown.
Hinge hinge_of(const ModelEntity& door);

/// Pose of the leaf's centre when it is turned by `angle` (rad, as in Hinge: 0 where it is drawn).
Transform<Map, Body> leaf_at(const ModelEntity& door, const Hinge& hinge, double angle);

/// Opening of a door, rad: turned from its closed position, positive to the side with more room (if equal:
/// counter-clockwise). And its conversion to the hinge's angle.
double opening_of(const Hinge& hinge, double angle);
double angle_of(const Hinge& hinge, double opening);

/// m from the hinge's axis to the farthest corner of the leaf, in the plane.
double leaf_reach(const ModelEntity& door, const Hinge& hinge);

}  // namespace parhelion

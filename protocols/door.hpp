// A door on its hinge: where the leaf is when it is open so far.
#pragma once

#include "protocols/model.hpp"

namespace parhelion {

/// The hinge of a door of the model. Where the model says none: at the left end of the box, closed as it is
/// drawn, and swinging a quarter turn to both sides, because nobody said to which side it opens.
Hinge hinge_of(const ModelEntity& door);

/// Where the centre of the leaf is when it is turned by `angle` (rad, as in Hinge: 0 where it is drawn).
Transform<Map, Body> leaf_at(const ModelEntity& door, const Hinge& hinge, double angle);

/// How far a door is open, rad: turned from where it closes its opening, positive to the side with more room
/// (of two alike: counter-clockwise). And back to the hinge's angle.
double opening_of(const Hinge& hinge, double angle);
double angle_of(const Hinge& hinge, double opening);

/// m from the hinge's axis to the farthest corner of the leaf, in the plane.
double leaf_reach(const ModelEntity& door, const Hinge& hinge);

}  // namespace parhelion

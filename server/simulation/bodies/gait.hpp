// A person's legs and arms as a function of the gait phase: feet on the ground do not slide, and none
// penetrates the floor.
#pragma once

#include <vector>

#include "protocols/frames.hpp"
#include "server/simulation/bodies/bodies.hpp"

namespace parhelion::simulation {

/// Lengths of an adult of 1.75 m (after Winter, Biomechanics and Motor Control of Human Movement, segment
/// lengths as fractions of the height H: thigh 0.245 H, shank 0.246 H, ankle 0.039 H).
struct PersonLengths {
  double thigh = 0.43;
  double shank = 0.43;
  double ankle = 0.07;
  double hip_half_width = 0.10;
  double shoulder_height = 1.42;
  double shoulder_half_width = 0.21;
};
inline constexpr PersonLengths kPerson;

/// Appends T_base_part of torso, left and right arm, left thigh, shank and foot, right thigh, shank and foot.
void gait_poses(double phase, double amplitude, double stride, std::vector<Transform<Base, Body>>& poses);

}  // namespace parhelion::simulation

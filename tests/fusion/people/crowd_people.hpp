// People as a laser sees them: two legs, a long coat or a trunk, and what they sit on or push.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "protocols/pose2.hpp"
#include "tests/fusion/people/crowd_shapes.hpp"

namespace parhelion::test {

/// What somebody holds, pushes or sits in. A wheelchair is part of the person, the others are not.
enum class Aid : std::uint8_t { none, frame, pram, trolley, wheelchair };

/// Somebody who walks from place to place with pauses, stands, or sits.
struct Walker {
  Eigen::Vector2d position, velocity = Eigen::Vector2d::Zero(), target, sway = Eigen::Vector2d::Zero();
  double heading = 0, speed = 1.2, phase = 0, pause = 0;
  double leg_radius = 0.06, stance = 0.1, body_width = 0.42, body_depth = 0.24, weight = 0;
  bool stands = false, skirt = false, sits = false;
  Aid aid = Aid::none;
  int pushes = -1;                   ///< number of whose wheelchair
  bool planted = false;              ///< a foot on the ground stays where it is
  Eigen::Vector2d coat{0.14, 0.18};  ///< m, half axes of a long coat
  double ahead = 0;                  ///< m: one foot before the other
  double next_step = 0;              ///< s until who stands moves a foot
};

double step_length(double speed);  ///< m
/// m: the middle of what is seen.
Eigen::Vector2d seen_at(const Walker& walker);
/// Shapes at `height` m above the floor.
void add_walker(std::vector<Shape>& shapes, const Walker& walker, double height, int id);

}  // namespace parhelion::test

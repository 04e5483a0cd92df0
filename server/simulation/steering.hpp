// How an agent finds its way: the arc that leads on and along which it can still stop before anything is in
// the way.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"
#include "server/simulation/planar.hpp"

namespace parhelion::simulation {

/// What a kind of agent can do.
struct SteeringLimits {
  double radius = 0.35;               ///< m, of the disc that it steers as
  double speed = 0.5;                 ///< m/s
  double yaw_rate = 1.2;              ///< rad/s
  double acceleration = 0.6;          ///< m/s^2
  double angular_acceleration = 3.0;  ///< rad/s^2
  double margin = 0.12;               ///< m, kept to everything...
  double narrow_margin = 0.04;        ///< ...but where no way is left with it: slowly, this
};

struct SteeringState {
  Twist2 wanted;                    ///< the newest decision
  double heading = 0;               ///< rad in the map, where it wants to go
  std::uint64_t heading_until = 0;  ///< step at which a wanderer thinks again
  double turn = 0;                  ///< +1 or -1 while it turns on the spot to get out
  std::size_t waypoint = 0;
  double waited = 0;               ///< s without progress on a patrol
  std::uint64_t detour_until = 0;  ///< step until which a patrol wanders around what blocks it
};

/// Obstacles around an agent; memory that is used again.
struct SteeringScratch {
  std::vector<const Footprint*> obstacles;
  std::vector<Footprint> predicted;
  Footprint disc;
};

/// m that a disc of `radius` at `pose` can go along the arc of curvature `kappa` (1/m) before it is closer
/// than `margin` to one of scratch.obstacles, at most `limit` (conservative advancement: never too much).
/// From an obstacle that is already closer the arc must lead away.
double free_length(const Pose2& pose, double radius, double margin, double kappa, double limit,
                   SteeringScratch& scratch);

/// The twist towards state.heading along the best arc of the dynamic window (after Fox, Burgard, Thrun 1997),
/// with arcs of fixed curvatures; turns on the spot where none is free.
Twist2 steer(const Pose2& pose, const SteeringLimits& limits, SteeringScratch& scratch, SteeringState& state);

}  // namespace parhelion::simulation

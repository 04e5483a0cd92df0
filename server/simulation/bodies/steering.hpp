// Local steering of an agent: an arc towards its heading on which it can stop before any obstacle.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"
#include "server/simulation/building/planar.hpp"

namespace parhelion::simulation {

/// Limits of a kind of agent.
struct SteeringLimits {
  double radius = 0.35;               ///< m, of its disc for steering
  double speed = 0.5;                 ///< m/s
  double yaw_rate = 1.2;              ///< rad/s
  double acceleration = 0.6;          ///< m/s^2
  double angular_acceleration = 3.0;  ///< rad/s^2
  double margin = 0.12;               ///< m, kept to all obstacles...
  double narrow_margin = 0.04;        ///< ...or this, slowly, where there is no other way
};

struct SteeringState {
  Twist2 wanted;                    ///< the newest decision
  double heading = 0;               ///< rad in the map, desired
  std::uint64_t heading_until = 0;  ///< step at which a wanderer chooses a new heading
  double turn = 0;                  ///< +1 or -1 while it turns on the spot to free itself
  std::size_t waypoint = 0;
  double waited = 0;               ///< s without progress on a patrol
  std::uint64_t detour_until = 0;  ///< step until which a patrol wanders around an obstacle
};

/// Obstacles around an agent; reused memory.
struct SteeringScratch {
  std::vector<const Footprint*> obstacles;
  std::vector<Footprint> predicted;
  Footprint disc;
};

/// m that a disc of `radius` at `pose` can move along the arc of curvature `kappa` (1/m) before it is closer
/// than `margin` to one of scratch.obstacles, at most `limit` (conservative advancement: never
/// overestimated). From an obstacle that is already closer the arc must lead away.
double free_length(const Pose2& pose, double radius, double margin, double kappa, double limit,
                   SteeringScratch& scratch);

/// The twist towards state.heading along the best arc of the dynamic window (after Fox, Burgard, Thrun 1997),
/// with arcs of fixed curvatures; turns on the spot if none is free.
Twist2 steer(const Pose2& pose, const SteeringLimits& limits, SteeringScratch& scratch, SteeringState& state);

}  // namespace parhelion::simulation

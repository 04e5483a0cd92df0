// Early warnings: a collision on the current course, and tipping over.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/joints.hpp"
#include "server/simulation/bodies/near_miss.hpp"
#include "server/simulation/bodies/watches.hpp"
#include "server/simulation/building/planar.hpp"

namespace parhelion::simulation {

struct RobotModel;

/// A footprint that moves along the arc of its twist.
struct MovingFootprint {
  const Footprint* local = nullptr;  ///< in its own frame
  Pose2 pose;
  Twist2 twist;  ///< in its own frame
};

/// s until the gap between two footprints, each on its arc, is at most `touch` (m); infinity: not within
/// `horizon`, or the gap is that small already. Conservative advancement: the gap closes no faster than both
/// fastest points move; advances are at least kMinAdvance, which bounds the work for grazing motion and the
/// error.
double time_to_contact(const MovingFootprint& a, const MovingFootprint& b, double touch, double horizon);
inline constexpr double kMinAdvance = 0.004;  // s

/// The first object on the path.
struct Ahead {
  std::string_view object, relation;  ///< names valid for this step
  PairKind pair = PairKind::none;
  bool undetectable = false;
  double time = 0;                                     ///< s until contact
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map: the object's point nearest to the robot
};

/// Reports collision_predicted when the time to a contact falls to kWarn. Repeated for the same object only
/// after the time was above kRearm (or the path was free) for kHold.
class CollisionPrediction {
 public:
  static constexpr double kWarn = 2.0;      // s
  static constexpr double kRearm = 2.6;     // s; prediction horizon
  static constexpr double kHold = 0.5;      // s
  static constexpr double kPeriod = 0.016;  // s: other bodies may change their motion
  /// Before the first check: the second follows after the `fraction` of kPeriod. Spreads the checks of
  /// robots that start together.
  void stagger(double fraction) {
    if (!checked_at_) wait_ = fraction * kPeriod;
  }
  /// Whether to search again: kPeriod is over; or a warning is possible because the motion changed or a far
  /// object may be near.
  bool due(SimulationTime now, const Twist2& twist) const;
  void update(const Supervised& body, const ObservedMotion& motion, const Twist2& twist,
              const std::optional<Ahead>& ahead, std::vector<Event>& events);

 private:
  std::map<std::string, SimulationTime, std::less<>>
      warned_;  ///< object, and the last time it was ahead within kRearm
  std::optional<SimulationTime> checked_at_;
  Twist2 twist_;
  double time_ = 0;         ///< s, time to contact at the newest check; kRearm if nothing is ahead
  bool is_warned_ = false;  ///< warned
  double wait_ = kPeriod;   ///< s until the next check
};

/// Margin to tipping over.
struct Tipping {
  double fraction = 1;  ///< fraction of the margin at rest on level ground; 0: tips
  double time = 0;  ///< s until tipping at the current rotation rate; infinity: no rotation in that direction
};

/// Reports tipping_predicted (value: s) when the margin is less than kSmallMargin and would be used up within
/// kWarn; repeated after this was not so for kHold.
class TippingPrediction {
 public:
  static constexpr double kWarn = 1.0;  // s
  static constexpr double kSmallMargin = 0.7;
  static constexpr double kHold = 0.5;  // s
  void update(const Supervised& body, const ObservedMotion& motion, const Tipping& tipping,
              std::vector<Event>& events);

 private:
  bool warned_ = false;
  SimulationTime threatened_;  ///< last prediction of tipping within kWarn
};

/// The margin to the attitude limits and, from its trend over kSmoothing, the time to them: all that is known
/// of a real robot's stability.
class AttitudeTrend {
 public:
  static constexpr double kSmoothing = 0.1;  // s
  Tipping update(const Transform<Map, Base>& T_map_base, const AttitudeLimits& limits, double dt);

 private:
  bool known_ = false;
  double fraction_ = 1, trend_ = 0;
};

/// Support polygon and centre of mass of a simulated robot, in base_link.
struct Stance {
  std::vector<Eigen::Vector2d> support;  ///< m, convex, counter-clockwise, in the plane z = 0
  Eigen::Vector3d center_of_mass = Eigen::Vector3d::Zero();  ///< m
};

/// With joints at `joints.positions` (others at their start positions), on level ground: supported by all
/// solid shapes within kFootHeight of the lowest one. Fewer than three points give no support.
Stance stance_of(const RobotModel& model, const Joints& joints);
inline constexpr double kFootHeight = 0.02;  // m

/// Force-angle stability (Papadopoulos and Rey 1996, eq. 4 to 12) without inertial forces: for each edge of
/// the support, the angle through which the robot can turn about it until its centre of mass is over the
/// edge, and the time for this at the current rotation rate. `up`: unit, base frame; `rotation_rate`: rad/s,
/// base frame. Without support the result is unknown: {1, infinity}.
Tipping tipping_of(const Stance& stance, const Eigen::Vector3d& up, const Eigen::Vector3d& rotation_rate);

/// State of a robot's predictions: collisions, near misses and tipping.
struct RobotPrediction {
  std::uint32_t epoch = 0;
  CollisionPrediction collision;
  NearMissWatch misses;
  TippingPrediction tipping;
  AttitudeTrend trend;
  Stance stance;
  std::vector<double> stance_joints;  ///< joint positions of `stance`
};

}  // namespace parhelion::simulation

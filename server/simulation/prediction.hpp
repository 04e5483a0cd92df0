// Warnings before the event: a collision along the present motion, a robot that is about to tip over.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/joints.hpp"
#include "server/simulation/near_miss.hpp"
#include "server/simulation/planar.hpp"
#include "server/simulation/watches.hpp"

namespace parhelion::simulation {

struct RobotModel;

/// A footprint that goes on along the arc of its twist.
struct MovingFootprint {
  const Footprint* local = nullptr;  ///< in its own frame
  Pose2 pose;
  Twist2 twist;  ///< in its own frame
};

/// s until the gap between two footprints, each on its arc, is no more than `touch` (m); infinity: not within
/// `horizon`, or it is that small now. Conservative advancement: the gap closes by no more than both fastest
/// points move; advances are at least kLeastAdvance, which bounds the work of a glancing pass and the error.
double time_to_contact(const MovingFootprint& a, const MovingFootprint& b, double touch, double horizon);
inline constexpr double kLeastAdvance = 0.004;  // s

/// What would be hit first.
struct Ahead {
  std::string_view object, relation;  ///< of names that stay for this step
  PairKind pair = PairKind::none;
  bool unsensed = false;
  double time = 0;                                     ///< s until it
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map: of the object's point nearest to the robot
};

/// collision_predicted when the time to a contact falls to kWarn, again for the same object only after it was
/// above kRearm (or nothing was in the way) for kHold.
class CollisionPrediction {
 public:
  static constexpr double kWarn = 2.0;      // s
  static constexpr double kRearm = 2.6;     // s; how far ahead is predicted
  static constexpr double kHold = 0.5;      // s
  static constexpr double kPeriod = 0.016;  // s: others may change their motion
  /// Before the first check: `share` of kPeriod after that comes the second. Robots that begin at once take
  /// turns.
  void stagger(double share) {
    if (!looked_) wait_ = share * kPeriod;
  }
  /// Whether what is ahead is to be searched again: kPeriod is over; or before a warning that may come now,
  /// since the motion changed or what was far may be near.
  bool due(SimulationTime now, const Twist2& twist) const;
  void update(const Supervised& body, const ObservedMotion& motion, const Twist2& twist,
              const std::optional<Ahead>& ahead, std::vector<Event>& events);

 private:
  std::map<std::string, SimulationTime, std::less<>>
      warned_;  ///< object, and when it was last ahead within kRearm
  std::optional<SimulationTime> looked_;
  Twist2 twist_;
  double time_ = 0;        ///< s, of what was ahead at the newest check; kRearm where nothing was
  bool said_ = false;      ///< it was warned of
  double wait_ = kPeriod;  ///< s until the next check
};

/// How near a body is to tipping over.
struct Tipping {
  double share = 1;  ///< of what is left at rest on level ground; 0: it tips
  double time = 0;   ///< s until it does, as it turns now; infinity: it does not turn that way
};

/// tipping_predicted (value: s) when less than kCareful is left and gone within kWarn; again after that was
/// not so for kHold.
class TippingPrediction {
 public:
  static constexpr double kWarn = 1.0;  // s
  static constexpr double kCareful = 0.7;
  static constexpr double kHold = 0.5;  // s
  void update(const Supervised& body, const ObservedMotion& motion, const Tipping& tipping,
              std::vector<Event>& events);

 private:
  bool warned_ = false;
  SimulationTime threatened_;  ///< when it last was to tip within kWarn
};

/// What is left of the attitude limits, and at its trend over kSmoothing the time to them: all that is known
/// of a real robot's stability.
class AttitudeTrend {
 public:
  static constexpr double kSmoothing = 0.1;  // s
  Tipping update(const Transform<Map, Base>& T_map_base, const AttitudeLimits& limits, double dt);

 private:
  bool known_ = false;
  double share_ = 1, trend_ = 0;
};

/// What a simulated robot stands on and where its mass is, in base_link.
struct Stance {
  std::vector<Eigen::Vector2d> support;  ///< m, convex, counter-clockwise, in the plane z = 0
  Eigen::Vector3d center_of_mass = Eigen::Vector3d::Zero();  ///< m
};

/// With its joints at `joints.positions` (those not named: where they start), on level ground: all of its
/// solid shapes within kFootHeight of the lowest one support it. Error-free: fewer than three points make no
/// support.
Stance stance_of(const RobotModel& model, const Joints& joints);
inline constexpr double kFootHeight = 0.02;  // m

/// Force-angle stability (Papadopoulos and Rey 1996, eq. 4 to 12) without forces of inertia: for each edge of
/// the support the angle through which the robot can turn about it until its centre of mass is over the edge,
/// and the time in which its present turn does that. `up`: unit, base frame; `rotation_rate`: rad/s, base
/// frame. Without support it is not known: {1, infinity}.
Tipping tipping_of(const Stance& stance, const Eigen::Vector3d& up, const Eigen::Vector3d& rotation_rate);

/// What is kept of a robot whose collisions, near misses and tipping are predicted.
struct RobotPrediction {
  std::uint32_t epoch = 0;
  CollisionPrediction collision;
  NearMissWatch misses;
  TippingPrediction tipping;
  AttitudeTrend trend;
  Stance stance;
  std::vector<double> stance_joints;  ///< positions that `stance` is of
};

}  // namespace parhelion::simulation

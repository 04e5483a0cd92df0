// Watches: each observes one aspect of a supervised body and reports its events, with hysteresis, so that an
// event is repeated only after its condition has ended. Supervision of the paper (section 4: "yaw pitch
// supervision", falls, climbing of stairs). All are deterministic functions of the observed motions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/frames.hpp"
#include "protocols/robot.hpp"
#include "protocols/zone.hpp"
#include "server/simulation/building/planar.hpp"

namespace parhelion::simulation {

class Building;
struct FixedObstacle;

/// Constant properties of a supervised body.
struct Supervised {
  std::string name;
  Eigen::Vector3d low = Eigen::Vector3d::Zero();   ///< m, base frame, corners of its bounding box
  Eigen::Vector3d high = Eigen::Vector3d::Zero();  ///< m
  std::optional<AttitudeLimits> limits;            ///< none: no warnings
  bool tilts = false;                              ///< can tip over: its attitude is watched
  bool falls = false;   ///< its height is measured, not a pose correction: falls are watched
  bool climbs = false;  ///< a robot: climbed steps are reported
};

/// Motion of a body at a step.
struct ObservedMotion {
  SimulationTime stamp;
  Transform<Map, Base> T_map_base;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();       ///< m/s, map frame, of base_link
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s, map frame
  bool attitude_known = true;  ///< false: pitch, roll and tipping are not reported
  std::uint32_t epoch = 0;     ///< changes when it was moved elsewhere
};

/// Event about a supervised body, at its position.
Event event_of(EventKind kind, const Supervised& body, const ObservedMotion& motion, double value = 0);

/// Reports movement_started (value: m/s) above kStartSpeed or kStartRate, and movement_stopped after kPause
/// below kStopSpeed and kStopRate.
class MovementWatch {
 public:
  static constexpr double kStartSpeed = 0.05, kStopSpeed = 0.02;  // m/s
  static constexpr double kStartRate = 0.10, kStopRate = 0.04;    // rad/s
  static constexpr double kPause = 0.25;                          // s
  void update(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events);
  /// The body is removed: ends a started movement.
  void close(const Supervised& body, const ObservedMotion& last, std::vector<Event>& events);

 private:
  bool moving_ = false;
  std::optional<SimulationTime> slow_since_;
};

/// Pitch, roll and yaw rate beyond the robot's warning and limit: each reported once, and again after it was
/// below kRearm of the threshold. Pitch and roll as in R = Rz Ry Rx. Tipped over: its z axis is farther than
/// kTipped from up, until it is nearer than kUpright; while tipped, pitch and roll are not reported.
class AttitudeWatch {
 public:
  static constexpr double kRearm = 0.8;
  static constexpr double kTipped = std::numbers::pi / 3;   // rad, 60 degrees: no robot recovers from there
  static constexpr double kUpright = std::numbers::pi / 6;  // rad, 30 degrees
  void update(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events);

 private:
  /// A threshold that was exceeded, until it is left.
  struct Latch {
    bool passed = false;
    bool update(double size, double threshold);
  };
  void watch_tilt(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events);
  void watch_yaw_rate(const Supervised& body, const ObservedMotion& motion, std::vector<Event>& events);
  Latch pitch_warning_, pitch_limit_, roll_warning_, roll_limit_, yaw_warning_, yaw_limit_;
  bool tipped_ = false;
};

/// fell: both its lowest point and its middle sank faster than kFall, and no longer do: reported at its
/// landing place; value: m that its lowest point is below where it began to sink faster than kSink. Driving
/// down a slope or pitching over an edge is not a fall. A fall deeper than kAbyss is reported immediately.
class FallWatch {
 public:
  static constexpr double kFall = 1.2;    // m/s: 7 cm of free fall
  static constexpr double kSink = 0.3;    // m/s: from rest 5 mm
  static constexpr double kAbyss = 20.0;  // m
  void update(const Supervised& body, const ObservedMotion& motion, double dt, std::vector<Event>& events);

 private:
  bool known_ = false, falling_ = false, reported_ = false;
  std::uint32_t epoch_ = 0;
  double lowest_ = 0, middle_ = 0;  ///< m, at the previous step
  double top_ = 0;                  ///< m, its lowest point when it last sank slowly
};

/// step_climbed: base_link is over a step of the model (label stairs) higher than what was under it before,
/// and is supported by it (within kReach of its top). Value: m from the start of the climb to the step's top.
/// A step is left only kEdge beyond its outline: no events from swaying on an edge.
class StepWatch {
 public:
  static constexpr double kReach = 0.15;  // m: tracks bridge the treads
  static constexpr double kEdge = 0.05;   // m
  void update(const Supervised& body, const ObservedMotion& motion, const Building& building,
              std::vector<Event>& events);

 private:
  bool known_ = false;
  std::uint32_t epoch_ = 0;
  double level_ = 0;     ///< m, top of the surface under it
  double began_ = 0;     ///< m, level at the start of the climb
  std::string current_;  ///< step under it; empty: a floor
  Footprint point_;      ///< base_link; reused memory
  std::vector<const FixedObstacle*> near_;
  const FixedObstacle* step_under(const Building& building, const Eigen::Vector3d& p);
};

/// zone_entered and zone_left by base_link; left only when it is kEdge outside.
class ZoneWatch {
 public:
  static constexpr double kEdge = 0.05;  // m
  void update(const Supervised& body, const ObservedMotion& motion, const std::vector<Zone>& zones,
              std::vector<Event>& events);
  void close(const Supervised& body, const ObservedMotion& last, const std::vector<Zone>& zones,
             std::vector<Event>& events);

 private:
  std::vector<bool> in_;  ///< by zone
};

}  // namespace parhelion::simulation

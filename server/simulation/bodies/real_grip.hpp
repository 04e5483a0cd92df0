// The gripper of a real robot and the virtual thing in it. The real fingers close on air, so what holds is
// geometry: the thing was between the open fingers, and by their encoders they have closed to its width.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/handling.hpp"
#include "server/simulation/physics/physics.hpp"
#include "server/simulation/robots/robot_twin.hpp"

namespace parhelion::simulation {

/// A thing between two fingers, along the line from one to the other.
struct Pinch {
  double gap = 0;        ///< m between the fingers' inner sides
  double width = 0;      ///< m of the thing on lines through both fingers
  bool between = false;  ///< its middle is between the fingers
};
/// None: no line through both fingers meets the thing.
std::optional<Pinch> pinch(const RobotTwin& twin, const std::vector<Transform<Map, Body>>& T_map_part,
                           const Agent& thing);

/// Whether a gripper can hold it: a box, a barrel or a container.
bool is_grippable(const Agent& agent);

/// What a gripper of a real robot works with in a step.
struct GripStep {
  const std::string& robot;  ///< its name: the events' subject
  const RobotTwin& twin;     ///< at this step
  double payload = 0;        ///< kg; 0: no limit
  Physics& physics;
  SimulationTime now;
  std::vector<Event>& events;  ///< receives payload_exceeded and joint_overload
};

class RealGrip {
 public:
  static constexpr double kTouch = 0.002;  // m: fingers wider open than the thing by less press on it
  static constexpr double kLoose = 0.004;  // m: wider open than it by more, they have let go
  static constexpr double kSlip = 0.04;    // m that the thing may lag behind the gripper; beyond, it is out

  /// Before a step, with the twin moved: the held thing follows the gripper. `jumped`: the robot appears
  /// here.
  void move_held(const RobotTwin& twin, bool present, bool jumped, Agents& agents, Physics& physics,
                 double dt);
  /// After a step: grips and releases, unless `frozen`.
  void update(const GripStep& step, bool frozen, Agents& agents);
  /// Lets go at once: the robot is no longer there.
  void release(Agents& agents, Physics& physics);

  /// The thing that it carries; empty: none.
  const std::string& held() const { return held_; }
  /// Whether it is held, or between the open fingers.
  bool is_around(const std::string& thing) const {
    return !thing.empty() && (thing == held_ || thing == around_ || thing == too_heavy_);
  }
  /// Of each finger on what they press on; empty: on nothing.
  std::vector<FingerForce> forces() const;
  /// m, map: the middle between the fingers at the newest step.
  static Eigen::Vector3d center(const RobotTwin& twin);
  /// Pose of the held thing with the parts at these poses.
  Transform<Map, Body> held_at(const RobotTwin& twin,
                               const std::vector<Transform<Map, Body>>& T_map_part) const;

  GripperWatch watch;

 private:
  void look(const RobotTwin& twin, const Agents& agents);
  void take(const GripStep& step, const Agent& thing);
  void watch_load(const GripStep& step, const Agent& thing);
  void release(const Agent* thing, Physics& physics);

  std::string around_;     // between the open fingers
  std::string held_;       // carried
  std::string too_heavy_;  // pressed on, not carried
  std::uint32_t epoch_ = 0;
  double force_ = 0;                            // N
  std::optional<Transform<Map, Body>> wanted_;  // pose of the held thing after the newest step
  RigidState motion_;                           // of the gripper at the held thing, in the coming step
  Eigen::Isometry3d T_grip_thing_ = Eigen::Isometry3d::Identity();
  std::vector<std::string> overloaded_;      // joints, as in the newest events
  std::vector<Transform<Map, Body>> poses_;  // reused memory
};

}  // namespace parhelion::simulation

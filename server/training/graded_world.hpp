// State for the evaluation of conditions: the graded robot and what is around it, from MR_EVENTS and
// MR_WORLD.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocols/codec.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"

namespace parhelion::training {

class GradedWorld {
 public:
  /// `robot`: name of the graded robot. Its camera, if any, is the description's, with all joints of its head
  /// at zero. The references must outlive this.
  GradedWorld(const SemanticModel& model, const RobotDescription& description, std::string robot);

  void take(const Event& event);
  void take(const WorldMessage& world);

  const std::string& robot() const { return robot_; }
  bool in_zone(const std::string& zone) const { return zones_.contains(zone); }
  bool moves() const { return moves_; }
  /// Whether the robot's origin is within `max_distance` (m, in the plane) of an agent or a part of the
  /// building. For an agent false while injection is degraded or the agent is withheld: the trainee could not
  /// see it.
  bool is_near(const std::string& entity, double max_distance) const;
  struct Motion {
    double pitch = 0, roll = 0;  ///< rad
    double yaw_rate = 0;         ///< rad/s, about its own z axis
    double speed = 0;            ///< m/s
  };
  /// None: the robot is not present. Pitch and roll without a measurement are 0.
  std::optional<Motion> motion() const;
  /// Whether the entity's origin is in the image, within `max_distance` (m) of the camera, and not occluded
  /// by another solid part of the building.
  bool sees(const std::string& entity, double max_distance) const;
  const ModelEntity* find_entity(const std::string& name) const;
  /// The highest step of a flight of stairs; nullptr: no such flight.
  const ModelEntity* top_of(const std::string& flight) const;

 private:
  std::optional<Eigen::Vector3d> place_of(const std::string& entity) const;
  bool hidden(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const std::string& target) const;

  const SemanticModel& model_;
  const RobotDescription& description_;
  std::string robot_;
  std::optional<double> distance_to(const std::string& entity) const;
  const WorldMessage::Entry* find_body(const std::string& entity) const;

  std::map<std::string, std::size_t, std::less<>> first_;  // index of each entity's first body in...
  std::vector<WorldMessage::Entry> bodies_;
  std::set<std::string> zones_;
  bool moves_ = false, injection_live_ = true;
  std::set<std::string, std::less<>> withheld_;  // agents not shown to the robot's sensors
};

}  // namespace parhelion::training

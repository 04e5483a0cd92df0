// What conditions are asked about: where the graded robot is and what is around it, from MR_EVENTS and
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

class Surroundings {
 public:
  /// `robot`: the name of the one that is graded. Its camera, where it has one, is the description's, with
  /// all joints of its head at zero. The references must outlive this.
  Surroundings(const SemanticModel& model, const RobotDescription& description, std::string robot);

  void take(const Event& event);
  void take(const WorldMessage& world);

  const std::string& robot() const { return robot_; }
  bool in_zone(const std::string& zone) const { return zones_.contains(zone); }
  bool moves() const { return moves_; }
  /// Its origin is no farther than `most` (m, in the plane) from that of an agent or a part of the building.
  /// Of an agent false while injection is degraded, or the agent withheld: the trainee could not see it.
  bool is_near(const std::string& entity, double most) const;
  struct Motion {
    double pitch = 0, roll = 0;  ///< rad
    double yaw_rate = 0;         ///< rad/s, about its own z axis
    double speed = 0;            ///< m/s
  };
  /// None: it is not there. Pitch and roll that nobody measures are 0.
  std::optional<Motion> motion() const;
  /// The entity's origin is in the picture, no farther from the camera than `most` (m), and no solid part of
  /// the building other than itself is in between.
  bool sees(const std::string& entity, double most) const;
  const ModelEntity* find_entity(const std::string& name) const;
  /// The highest step of a flight; nullptr: there is no such flight.
  const ModelEntity* top_of(const std::string& flight) const;

 private:
  std::optional<Eigen::Vector3d> place_of(const std::string& entity) const;
  bool hidden(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const std::string& target) const;

  const SemanticModel& model_;
  const RobotDescription& description_;
  std::string robot_;
  std::optional<double> distance_to(const std::string& entity) const;
  const WorldMessage::Entry* find_body(const std::string& entity) const;

  std::map<std::string, std::size_t, std::less<>> first_;  // body of each entity in...
  std::vector<WorldMessage::Entry> bodies_;
  std::set<std::string> zones_;
  bool moves_ = false, sensed_ = true;
  std::set<std::string, std::less<>> withheld_;  // agents that its sensors do not show
};

}  // namespace parhelion::training

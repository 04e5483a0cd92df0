// The doors of a building: the poses of their leaves, their motion, and commands.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/instructor_command.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"
#include "server/simulation/building/doors.hpp"

namespace parhelion::simulation {

class Agents;
class Building;
struct FixedObstacle;

class DoorSet {
 public:
  DoorSet() = default;
  /// Ascending id, from Building::enter().
  explicit DoorSet(std::vector<Door> doors) : doors_(std::move(doors)) {}

  const std::vector<Door>& all() const { return doors_; }
  std::vector<Door>& all() { return doors_; }
  /// nullptr: no such door.
  Door* find(const std::string& name);
  /// Whether somebody at p (map, m) pushes the leaf open by walking on.
  bool opens_when_pushed(const Building& building, const FixedObstacle& leaf, const Eigen::Vector2d& p) const;

  /// An instructor's command of a door's angle. Error: an unknown door, or an angle outside its range.
  Status command(const DoorCommand& command, Building& building, Agents& agents, Physics& physics);
  /// Measured opening of a real door, rad from its closed angle; none: not measured.
  void observe(const std::string& name, std::optional<double> opening);
  /// Copies the angles of the same doors of an earlier model.
  void keep(const std::vector<Door>& old, Building& building, Agents& agents, Physics& physics);

  /// Before the physics: turns real leaves to their reported angles, and applies friction and closers to the
  /// others.
  void move(Building& building, Agents& agents, Physics& physics, double dt);
  /// After the physics: reads the leaves' poses and the loads on their hinges.
  void read(Building& building, const Physics& physics, double dt);
  /// Appends the states of doors that have moved.
  void append_states(std::vector<BodyState>& bodies) const;

 private:
  Status unknown(const std::string& name) const;
  std::vector<Door> doors_;
};

/// Takes it off its hinge: from now on a free body.
void unhinge(Door& door, Physics& physics);

}  // namespace parhelion::simulation

// The doors of a building: where their leaves are, what moves them, and commands to them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/instructor_command.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"
#include "server/simulation/doors.hpp"

namespace parhelion::simulation {

class Agents;
class Building;
struct FixedObstacle;

class DoorSet {
 public:
  DoorSet() = default;
  /// Ascending id, as Building::enter() gives them.
  explicit DoorSet(std::vector<Door> doors) : doors_(std::move(doors)) {}

  const std::vector<Door>& all() const { return doors_; }
  std::vector<Door>& all() { return doors_; }
  /// nullptr: there is no such door.
  Door* find(const std::string& name);
  /// Whether somebody at p (map, m) who walks on against that leaf of the building pushes it open.
  bool gives_way(const Building& building, const FixedObstacle& leaf, const Eigen::Vector2d& p) const;

  /// An instructor's command of a door's angle. Error: an unknown door, or an angle that it cannot have.
  Status command(const DoorCommand& command, Building& building, Agents& agents, Physics& physics);
  /// What sensors measure of a real door: rad from where it closes its opening, or nothing.
  void observe(const std::string& name, std::optional<double> opening);
  /// The doors stand as those of an earlier model did that are of the same make.
  void keep(const std::vector<Door>& old, Building& building, Agents& agents, Physics& physics);

  /// Before the physics: real leaves that turn to where they are reported, friction and closers of the
  /// others.
  void move(Building& building, Agents& agents, Physics& physics, double dt);
  /// After the physics: where the leaves are now, and what pulled at their hinges.
  void read(Building& building, const Physics& physics, double dt);
  /// Appends the state of each door that has moved.
  void append_states(std::vector<BodyState>& bodies) const;

 private:
  Status unknown(const std::string& name) const;
  std::vector<Door> doors_;
};

/// Off its hinge: from now on it lies about.
void unhinge(Door& door, Physics& physics);

}  // namespace parhelion::simulation

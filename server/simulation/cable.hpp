// A cable: capsules in a row, each held to the next by a ball joint with a little friction. It hangs, is
// dragged, gripped and lies over things; it does not stretch, twist is not springy, and it passes through
// itself.
#pragma once

#include <string>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"
#include "server/simulation/physics.hpp"

namespace parhelion::simulation {

/// `size`: m, its length and twice its diameter.
struct CableForm {
  std::size_t links = 0;
  double pitch = 0;   ///< m, from joint to joint
  double radius = 0;  ///< m
  double mass = 0;    ///< kg, of the whole
};
CableForm cable_form(const Eigen::Vector3d& size);
Status check_cable(const std::string& agent, const Eigen::Vector3d& size);

/// Its links, in their own frames: the origin in the middle, x along.
std::vector<BodyDefinition> cable_bodies(const Eigen::Vector3d& size);
/// Appends where they are when it lies straight along x, its middle at the origin.
void cable_poses(const Eigen::Vector3d& size, std::vector<Transform<Base, Body>>& poses);

class Cable {
 public:
  explicit Cable(const Eigen::Vector3d& size) : size_(size), form_(cable_form(size)) {}

  void enter(Physics& physics);
  void leave(Physics& physics);
  /// Puts it there, straight and at rest.
  void put(Physics& physics, const Transform<Map, Base>& T_map_base);
  PhysicsHandle middle() const { return handles_[handles_.size() / 2]; }
  bool owns(PhysicsHandle handle) const { return handle >= handles_.front() && handle <= handles_.back(); }

  /// After a step; false: no link has moved.
  bool observe(Physics& physics);
  /// m, map: its links' ends, one after the other.
  std::vector<Eigen::Vector3d> points() const;
  void append_states(BodyId first, std::uint32_t epoch, std::vector<BodyState>& bodies) const;
  const CableForm& form() const { return form_; }

 private:
  Eigen::Vector3d size_;
  CableForm form_;
  std::vector<PhysicsHandle> handles_;
  std::vector<JointHandle> joints_;
  std::vector<RigidState> states_;  // at the newest step
};

}  // namespace parhelion::simulation

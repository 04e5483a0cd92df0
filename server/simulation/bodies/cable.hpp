// A cable: a chain of capsules, connected by ball joints with a little friction. It hangs, and can be
// dragged, gripped and laid over objects; it does not stretch, has no torsional stiffness, and passes through
// itself.
#pragma once

#include <string>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"
#include "server/simulation/physics/physics.hpp"

namespace parhelion::simulation {

/// `size`: m, its length and twice its diameter.
struct CableForm {
  std::size_t links = 0;
  double pitch = 0;   ///< m, from joint to joint
  double radius = 0;  ///< m
  double mass = 0;    ///< kg, total
};
CableForm cable_form(const Eigen::Vector3d& size);
Status check_cable(const std::string& agent, const Eigen::Vector3d& size);

/// Its links, in their own frames: origin at the centre, x along the link.
std::vector<BodyDefinition> cable_bodies(const Eigen::Vector3d& size);
/// Appends the poses of a straight cable along x, with its centre at the origin.
void cable_poses(const Eigen::Vector3d& size, std::vector<Transform<Base, Body>>& poses);

class Cable {
 public:
  explicit Cable(const Eigen::Vector3d& size) : size_(size), form_(cable_form(size)) {}

  void enter(Physics& physics);
  void leave(Physics& physics);
  /// Places it, straight and at rest.
  void put(Physics& physics, const Transform<Map, Base>& T_map_base);
  PhysicsHandle middle() const { return handles_[handles_.size() / 2]; }
  bool owns(PhysicsHandle handle) const { return handle >= handles_.front() && handle <= handles_.back(); }

  /// After a step; false: no link has moved.
  bool observe(Physics& physics);
  /// m, map: the ends of its links, in order.
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

// Responses of a tree's parts to an impulse on one of them.
#include "server/simulation/physics/joint_tree.hpp"

namespace parhelion::simulation {

/// Combines parts connected by holding joints.
void JointTree::compose() {
  composites_.clear();
  const auto start = [this](Link& link, int parent, int joint) {
    link.composite = static_cast<int>(composites_.size());
    composites_.push_back({parent, joint, link.root, 0, Vector6::Zero()});
  };
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].root == static_cast<int>(i)) start(links_[i], -1, -1);
  }
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = joints_[i];
    const int parent = links_[static_cast<std::size_t>(joint.parent)].composite;
    Link& child = links_[static_cast<std::size_t>(joint.child)];
    if (joint.treads[joint.tread].holds) {
      child.composite = parent;
    } else {
      start(child, parent, static_cast<int>(i));
    }
  }
}

JointTree::Vector6 JointTree::about_point(int link, const btVector3& moment, const btVector3& along) const {
  const Link& its = links_[static_cast<std::size_t>(link)];
  const btVector3 turn = moment + its.arm.cross(along);
  Vector6 v;
  v << turn.x(), turn.y(), turn.z(), along.x(), along.y(), along.z();
  return v;
}

void JointTree::respond(int link, const Vector6& impulse, std::vector<Response>& responses) {
  const Link& its = links_[static_cast<std::size_t>(link)];
  Vector6 passed = impulse;
  for (Composite& composite : composites_) composite.pulled = 0;
  for (Composite* at = &composites_[static_cast<std::size_t>(its.composite)]; at->parent >= 0;
       at = &composites_[static_cast<std::size_t>(at->parent)]) {
    Composite& composite = *at;
    const Joint& joint = joints_[static_cast<std::size_t>(composite.joint)];
    composite.pulled = joint.axis.dot(passed);
    passed -= joint.response * (joint.compliance * composite.pulled);
  }
  for (std::size_t i = 0; i < composites_.size(); ++i) {
    Composite& composite = composites_[i];
    if (composite.root != its.root) continue;
    if (composite.parent < 0) {
      composite.change.noalias() = root_compliance_[static_cast<std::size_t>(its.root)] * passed;
    } else {
      const Joint& joint = joints_[static_cast<std::size_t>(composite.joint)];
      const Vector6& parent = composites_[static_cast<std::size_t>(composite.parent)].change;
      const double turn = joint.compliance * (composite.pulled - joint.response.dot(parent));
      composite.change = parent + joint.axis * turn;
    }
    responses.push_back({static_cast<int>(i), composite.change});
  }
}

btVector3 JointTree::velocity_of_center(int link, const Vector6& motion, double turning) const {
  const btVector3 turn(motion[0], motion[1], motion[2]);
  return btVector3(motion[3], motion[4], motion[5]) +
         turning * turn.cross(links_[static_cast<std::size_t>(link)].arm);
}

}  // namespace parhelion::simulation

// Exact simultaneous solution of robots' joints. Included by physics*.cpp only. Implemented in joint_tree.cpp
// (a step) and joint_tree_response.cpp (responses of parts to impulses).
#pragma once

#include <btBulletDynamicsCommon.h>

#include <Eigen/Core>
#include <array>
#include <vector>

namespace parhelion::simulation {

class PartJoint;

/// Target of a joint in one step.
struct JointAim {
  btVector3 point{0, 0, 0};  ///< of the joint, map
  btVector3 axis{1, 0, 0};   ///< unit, map: axis of rotation or sliding
  bool slides = false;
  btVector3 shift{0, 0, 0},
      turn{0, 0, 0};                  ///< m/s and rad/s of b relative to a that correct its position error
  double speed = 0, max_impulse = 0;  ///< of the motor: m/s or rad/s, and N s or N m s in the step
  bool limited = false, is_lower = false;  ///< near a limit, which one...
  double limit_speed = 0;                  ///< ...and the speed bound there, lower or upper
};

/// Joint load of a step, on b: N s, and N m s about its point.
struct JointImpulse {
  btVector3 force{0, 0, 0}, moment{0, 0, 0};
  double limit = 0;  ///< impulse of its limit about or along the axis
};

/// The joints between parts of robots form a forest: its impulses follow from one pass to the roots and one
/// back (Featherstone's articulated bodies; a joint that holds its speed merges its parts to one body).
/// Solving row by row would take a number of sweeps that grows with the mass ratio. Motors and limits choose
/// between holding a speed and giving their maximum effort.
class JointTree {
 public:
  /// About a tree's point: angular and linear velocity (rad/s, m/s), or moment and force (N m s, N s).
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  /// Effect of an impulse on a composite: parts that move as one because their joints hold their speeds.
  struct Response {
    int composite = -1;
    Vector6 change;
  };

  void clear();
  /// Bodies are indices in the solver's pool; a child's joint comes after its parent's.
  void add(PartJoint& joint, const JointAim& aim, int a, int b,
           const btAlignedObjectArray<btSolverBody>& pool);
  bool empty() const { return joints_.empty(); }
  /// Applies the joints' targets to the bodies. True: motors or limits changed their choice, so earlier
  /// responses are no longer valid.
  bool solve(btAlignedObjectArray<btSolverBody>& pool);
  /// Stores the loads in the joints.
  void finish() const;

  /// Link of a body in the pool; -1: not in a tree.
  int link(int body) const;
  int links() const { return static_cast<int>(links_.size()); }
  int body(int link) const { return links_[static_cast<std::size_t>(link)].body; }
  int composite(int link) const { return links_[static_cast<std::size_t>(link)].composite; }
  int composites() const { return static_cast<int>(composites_.size()); }
  /// `along`: force, and moment about the body's centre of mass.
  Vector6 about_point(int link, const btVector3& moment, const btVector3& along) const;
  /// Appends the effect of an impulse on a part, for each composite of its tree.
  void respond(int link, const Vector6& impulse, std::vector<Response>& responses);
  /// Velocity of a part's centre of mass for this motion of its tree's point, with its rotation weighted by
  /// `turning`.
  btVector3 velocity_of_center(int link, const Vector6& motion, double turning) const;

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  /// Impulse of motor and limit over the joint's speed, a decreasing staircase: at `speed` any value within
  /// the bounds, or `low` at any speed between the neighbours'.
  struct Tread {
    bool holds = false;
    double speed = 0, low = 0, high = 0;
  };
  struct Link {
    int body;  // index in the pool
    int root;  // link
    int composite = -1;
    btVector3 point, arm;  // of the tree; from there to the body's centre of mass
    Matrix6 inertia, articulated;
    Vector6 bias, change;
  };
  struct Composite {
    int parent;  // composite; -1: of a root
    int joint;   // free joint to the parent
    int root;    // link
    double pulled;
    Vector6 change;
  };
  struct Joint {
    PartJoint* joint = nullptr;
    int parent = 0, child = 0;  // links
    Vector6 axis, target, lacks, response, passed, impulse, step;
    double compliance = 0, gives = 0;
    JointAim aim;
    std::array<Tread, 4> treads{};
    std::size_t tread = 0, count = 0;
  };
  int link_of(int body, const btAlignedObjectArray<btSolverBody>& pool, int parent);
  static void lay_treads(Joint& joint);
  Vector6 velocity(const Link& link, const btAlignedObjectArray<btSolverBody>& pool) const;
  void articulate();
  void compose();
  void pass();
  bool change_treads();

  std::vector<Link> links_;
  std::vector<Joint> joints_;
  std::vector<Composite> composites_;     // parents first
  std::vector<int> link_by_body_;         // by index in the pool; may be shorter
  std::vector<Matrix6> root_compliance_;  // by link; of roots
  bool articulated_ = false;
};

}  // namespace parhelion::simulation

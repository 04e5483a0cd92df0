// The joints of robots, solved together and exactly. Included by physics*.cpp only. The parts of JointTree
// are joint_tree.cpp (a step) and joint_tree_response.cpp (how parts answer an impulse).
#pragma once

#include <btBulletDynamicsCommon.h>

#include <Eigen/Core>
#include <array>
#include <vector>

namespace parhelion::simulation {

class PartJoint;

/// What a joint asks for in one step.
struct JointAim {
  btVector3 point{0, 0, 0};  ///< of the joint, map
  btVector3 axis{1, 0, 0};   ///< unit, map: about which it turns or along which it slides
  bool slides = false;
  btVector3 shift{0, 0, 0}, turn{0, 0, 0};  ///< m/s and rad/s of b against a that undo what it gave way
  double speed = 0, most = 0;               ///< of the motor: m/s or rad/s, and N s or N m s in the step
  bool limited = false, is_lower = false;   ///< near a limit, which one...
  double limit_speed = 0;                   ///< ...and the speed that it asks for, at least or at most
};

/// What a joint bore in a step, on b: N s, and N m s about its point.
struct JointImpulse {
  btVector3 force{0, 0, 0}, moment{0, 0, 0};
  double limit = 0;  ///< the fraction of its limit in what acts about or along the axis
};

/// The joints between parts of robots are a forest: its impulses follow in one pass to the roots and one back
/// (Featherstone's articulated bodies; a joint whose motor holds its speed makes one body of its parts),
/// where going from row to row would take as many sweeps as masses differ. Motors and limits choose between
/// holding a speed and giving their most.
class JointTree {
 public:
  /// About a tree's point: turning and the velocity there (rad/s, m/s), or moment and force (N m s, N s).
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  /// What an impulse changes of parts that move as one: those whose joints hold their speeds.
  struct Response {
    int composite = -1;
    Vector6 change;
  };

  void clear();
  /// Bodies are numbers in the solver's pool; a child's joint comes after its parent's.
  void add(PartJoint& joint, const JointAim& aim, int a, int b,
           const btAlignedObjectArray<btSolverBody>& pool);
  bool empty() const { return joints_.empty(); }
  /// Gives the bodies what their joints ask for now. Whether motors or limits chose anew: what responded
  /// before responds in another way now.
  bool solve(btAlignedObjectArray<btSolverBody>& pool);
  /// The joints learn what they bore.
  void finish() const;

  /// Of a body in the pool; -1: not of a tree.
  int link(int body) const;
  int links() const { return static_cast<int>(links_.size()); }
  int body(int link) const { return links_[static_cast<std::size_t>(link)].body; }
  int composite(int link) const { return links_[static_cast<std::size_t>(link)].composite; }
  int composites() const { return static_cast<int>(composites_.size()); }
  /// `along`: force, and moment about the body's centre of mass.
  Vector6 about_point(int link, const btVector3& moment, const btVector3& along) const;
  /// Adds what an impulse on a part changes, of each composite of its tree.
  void respond(int link, const Vector6& impulse, std::vector<Response>& responses);
  /// Velocity of a part's centre of mass where its tree's point moves like this and its turning counts by
  /// `turning`.
  btVector3 velocity_of_center(int link, const Vector6& motion, double turning) const;

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  /// Impulse of motor and limit against the joint's speed, a staircase that falls: at `speed` whatever is
  /// within the bounds, or `low` at any speed between the neighbours'.
  struct Tread {
    bool holds = false;
    double speed = 0, low = 0, high = 0;
  };
  struct Link {
    int body;  // in the pool
    int root;  // link
    int composite = -1;
    btVector3 point, arm;  // of the tree; from there to its centre of mass
    Matrix6 inertia, articulated;
    Vector6 bias, change;
  };
  struct Composite {
    int parent;  // composite; -1: of a root
    int joint;   // that gives, to the parent
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
  std::vector<int> link_by_body_;         // in the pool; shorter than it
  std::vector<Matrix6> root_compliance_;  // by link; of roots
  bool articulated_ = false;
};

}  // namespace parhelion::simulation

// Contacts of robots' jointed parts. Included by physics*.cpp only.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "server/simulation/physics/joint_tree.hpp"

namespace parhelion::simulation {

/// Contacts of parts of a JointTree. A row is one scalar constraint, a contact's normal or one direction of
/// its friction; its sides are the two bodies on which it acts, of which at least one is in a tree. An
/// impulse on such a part moves everything connected to it by holding joints, so a row has the effective mass
/// of the whole and converges in as few sweeps as for one body; alternating between rows and joints would
/// take a number of sweeps that grows with the mass ratio.
class TreeContacts {
 public:
  using Bodies = btAlignedObjectArray<btSolverBody>;
  TreeContacts();
  void clear();
  bool empty() const { return rows_.empty(); }
  /// Adds a contact or friction; returns its index here, or -1 if neither side is in a tree. `constraint`
  /// must not move in memory. The row starts with `warm_start_scale` times the impulse that Bullet's setup
  /// gave it.
  int add(btSolverConstraint& constraint, const JointTree& tree, Bodies& bodies, double warm_start_scale);
  /// After the trees chose which joints hold: computes responses to impulses, and current velocities.
  void prepare(JointTree& tree, const Bodies& bodies);
  /// Solves one row towards its target speed, within its limits; returns its change, m/s.
  double solve(int row, Bodies& bodies);
  /// The same for penetration correction, which moves bodies without changing their velocities.
  double push(int row, Bodies& bodies);
  /// Applies the impulses since the last call to the parts.
  void apply_to_bodies(Bodies& bodies);
  /// Applies the penetration correction to the parts; their rotation is weighted by `turning`.
  void apply_pushes_to_bodies(const JointTree& tree, Bodies& bodies, double turning) const;

 private:
  using Vector6 = JointTree::Vector6;
  struct Side {
    bool is_a = true;
    int body = 0, link = -1;          // link -1: not in a tree
    int composite = -1;               // of the link: parts that move as one, see JointTree::Response
    Vector6 unit_impulse;             // on the link by 1 N s of the row
    std::size_t first = 0, last = 0;  // range in responses_
  };
  struct Row {
    btSolverConstraint* constraint = nullptr;  // Bullet's row, which holds the impulse and its limits
    Side a, b;
    double target_change = 0;    // m/s, since prepare()
    double penetration = 0;      // m/s for penetration correction
    double weight = 0;           // N s per m/s
    double applied_impulse = 0;  // N s, on the parts so far
  };
  /// Compliance of a side, m/s per N s.
  double prepare(const Row& row, Side& side, JointTree& tree, const Bodies& bodies);
  double change(const Row& row, const Side& side, const Bodies& bodies, bool pushes) const;
  void apply(const Row& row, const Side& side, double impulse, Bodies& bodies, bool pushes);
  double solve(const Row& row, double target, btScalar& sum, double low, double high, Bodies& bodies,
               bool pushes);

  std::vector<Row> rows_;
  std::vector<JointTree::Response> responses_;
  std::vector<Vector6> changes_, pushes_;  // by composite, since prepare()
};

}  // namespace parhelion::simulation

// Contacts of robots' jointed parts. Included by physics*.cpp only.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "server/simulation/joint_tree.hpp"

namespace parhelion::simulation {

/// Contact rows with a side in a JointTree. An impulse on such a part moves everything connected to it by
/// holding joints, so a row has the effective mass of the whole and converges in as few sweeps as for one
/// body; alternating between rows and joints would take a number of sweeps that grows with the mass ratio.
class TreeContacts {
 public:
  using Bodies = btAlignedObjectArray<btSolverBody>;
  TreeContacts();
  void clear();
  bool empty() const { return rows_.empty(); }
  /// Adds a contact or friction; returns its index here, or -1 if neither side is in a tree. Rows must not
  /// move in memory. They start with `warmer` times their last impulse.
  int add(btSolverConstraint& row, const JointTree& tree, Bodies& bodies, double warmer);
  /// After the trees chose which joints hold: computes responses to impulses, and current velocities.
  void prepare(JointTree& tree, const Bodies& bodies);
  /// Solves one row towards its target speed, within its limits; returns its change, m/s.
  double solve(int row, Bodies& bodies);
  /// The same for penetration correction, which moves bodies without changing their velocities.
  double push(int row, Bodies& bodies);
  /// Applies the impulses since the last call to the parts.
  void hand_over(Bodies& bodies);
  /// Applies the penetration correction to the parts; their rotation is weighted by `turning`.
  void hand_over_pushes(const JointTree& tree, Bodies& bodies, double turning) const;

 private:
  using Vector6 = JointTree::Vector6;
  struct Side {
    bool is_a = true;
    int body = 0, link = -1;  // link -1: not in a tree
    int composite = -1;
    Vector6 along;                    // impulse of 1 N s
    std::size_t first = 0, last = 0;  // responses
  };
  struct Row {
    btSolverConstraint* its = nullptr;
    Side a, b;
    double wanted = 0;       // m/s, target change since prepare()
    double penetration = 0;  // m/s for penetration correction
    double weight = 0;       // N s per m/s
    double given = 0;        // N s, applied to the parts so far
  };
  /// Compliance of a side, m/s per N s.
  double prepare(const Row& row, Side& side, JointTree& tree, const Bodies& bodies);
  double change(const Row& row, const Side& side, const Bodies& bodies, bool pushes) const;
  void apply(const Row& row, const Side& side, double impulse, Bodies& bodies, bool pushes);
  double solve(const Row& row, double wanted, btScalar& sum, double low, double high, Bodies& bodies,
               bool pushes);

  std::vector<Row> rows_;
  std::vector<JointTree::Response> responses_;
  std::vector<Vector6> changes_, pushes_;  // by composite, since prepare()
};

}  // namespace parhelion::simulation

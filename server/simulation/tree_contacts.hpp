// Contacts of robots' parts that joints hold. Included by physics*.cpp only.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <vector>

#include "server/simulation/joint_tree.hpp"

namespace parhelion::simulation {

/// Contact rows of which a side is of a JointTree. An impulse on such a part moves all that its joints hold
/// to it, so that a row is as heavy as what hangs together and settles in as few sweeps as that of one body;
/// row and joint in turn would take as many as masses differ.
class TreeContacts {
 public:
  using Bodies = btAlignedObjectArray<btSolverBody>;
  TreeContacts();
  void clear();
  bool empty() const { return rows_.empty(); }
  /// Of a contact or friction; its number here, or -1 where neither side is of a tree. Rows stay where they
  /// are. They start with `warmer` times the impulse that they have and gave.
  int add(btSolverConstraint& row, const JointTree& tree, Bodies& bodies, double warmer);
  /// After the trees chose how their joints hold: what impulses change, and what velocities are now.
  void prepare(JointTree& tree, const Bodies& bodies);
  /// One row towards its speed, within its limits; m/s that it changed.
  double solve(int row, Bodies& bodies);
  /// The same of what undoes penetration, which moves bodies without giving them speed.
  double push(int row, Bodies& bodies);
  /// Gives the parts themselves the impulses since the last time.
  void hand_over(Bodies& bodies);
  /// Gives the parts what pushed them; their turning counts by `turning`.
  void hand_over_pushes(const JointTree& tree, Bodies& bodies, double turning) const;

 private:
  using Vector6 = JointTree::Vector6;
  struct Side {
    bool is_a = true;
    int body = 0, link = -1;  // link -1: not of a tree
    int composite = -1;
    Vector6 along;                    // impulse of 1 N s
    std::size_t first = 0, last = 0;  // responses
  };
  struct Row {
    btSolverConstraint* its = nullptr;
    Side a, b;
    double wanted = 0;       // m/s of change since prepare()
    double penetration = 0;  // m/s that undo it
    double weight = 0;       // N s per m/s
    double given = 0;        // N s that the parts have
  };
  /// How much a side gives way, m/s per N s.
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

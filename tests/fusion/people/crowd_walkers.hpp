// The people of a crowd: who they are, where they stand, how they walk.
#pragma once

#include <vector>

#include "tests/fusion/people/crowd_people.hpp"
#include "tests/fusion/people/crowd_room.hpp"

namespace parhelion::test {

class Walkers {
 public:
  Walkers(const CrowdOptions& options, Room& room, Random& random)
      : options_(options), room_(room), random_(random) {}

  void add_person(bool stands);
  /// To those who are there: other shapes and postures than those of plain crowds.
  void vary_all();
  /// Who pushes something or sits in a wheelchair.
  void add_aid();
  void add_seated();
  /// Who stand and talk.
  void add_group();
  /// With the back to a wall.
  void add_leaning();

  void step(double dt);  ///< s
  const std::vector<Walker>& all() const { return walkers_; }

 private:
  void vary(Walker& walker);
  static void step_carer(Walker& carer, const Walker& chair, double dt);
  void step_walker(Walker& walker, double dt);
  void pause(Walker& walker, double clearance, double dt);
  void walk(Walker& walker, double clearance, double dt);
  void shift_feet(Walker& walker, double dt);

  const CrowdOptions& options_;
  Room& room_;
  Random& random_;
  std::vector<Walker> walkers_;
};

}  // namespace parhelion::test

// A made-up site in two versions that share no code: as it was surveyed, for Parhelion, and as it is now, for
// the robot. Since the survey furniture was moved, things were left standing about, and the door was opened.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"
#include "protocols/model.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::test {

/// Real numbers of a seed, the same on each machine.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double within(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1.0p-53;
  }
  bool chance(double p) { return within(0, 1) < p; }

 private:
  std::mt19937_64 random_;
};

struct Site {
  std::uint64_t seed = 0;
  double length = 0, width = 0;         ///< m: x and y of two rooms with one wall between them
  double partition = 0;                 ///< m, x of that wall
  double door_low = 0, door_width = 0;  ///< m, y of the opening; the hinge is at its upper end
  double door_angle = 0;                ///< rad, by which it is open now; it was closed
  struct Piece {
    bool round = false;
    Pose2 surveyed, now;
    double size_x = 0, size_y = 0, height = 0;  ///< m; of a round one size_x is its diameter
    bool was_there = true;                      ///< at the survey
  };
  std::vector<Piece> furniture;
  Pose2 start, other_start;                         ///< of the real robot, and of one in the other room
  std::vector<Eigen::Vector2d> route, other_route;  ///< the goal is last
};

Site make_site(std::uint64_t seed);

/// m from p to the nearest wall or piece, as surveyed or as it is now.
double clearance(const Site& site, const Eigen::Vector2d& p);

/// What was surveyed.
pose::GridMap survey_map(const Site& site);
SemanticModel survey_model(const Site& site, const std::string& map_id);
/// What is there now, in the form that examples/robot reads.
std::string true_building(const Site& site);

}  // namespace parhelion::test

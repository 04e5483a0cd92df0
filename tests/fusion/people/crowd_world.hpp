// A room with its people and robots, one of which carries the laser.
#pragma once

#include <vector>

#include "tests/fusion/people/crowd_walkers.hpp"

namespace parhelion::test {

struct Rover {
  Pose2 pose;
  Eigen::Vector2d target;
  double speed = 0.5;  ///< m/s
  bool round = true;
  double size = 0.4;  ///< m
};

class World {
 public:
  explicit World(const CrowdOptions& options);
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  void step(double dt);                    ///< s
  Pose2 own() const { return own_.pose; }  ///< of the laser
  Pose2 estimate();                        ///< of the laser, with new noise
  const std::vector<Walker>& walkers() const { return walkers_.all(); }
  const std::vector<Rover>& rovers() const { return rovers_; }
  const std::vector<Shape>& walls() const { return room_.walls(); }
  Random& random() { return random_; }
  /// All shapes at the height of the laser.
  std::vector<Shape> shapes() const;

 private:
  void add_furniture();
  void add_rovers();
  void add_varied();
  void add_seats();
  void step_rover(Rover& rover, double dt);

  CrowdOptions options_;
  Random random_;
  Room room_;
  Walkers walkers_;
  std::vector<Rover> rovers_;
  Rover own_;
  Eigen::Vector2d drift_ = Eigen::Vector2d::Zero();  // m, of the estimate
  double yaw_drift_ = 0;
};

}  // namespace parhelion::test

// A room with doorways, and what stands in it, as a laser at one height sees it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "tests/fusion/people/crowd_shapes.hpp"

namespace parhelion::test {

class Room {
 public:
  /// m; `laser_height` above the floor. Its corner is at the map's origin.
  Room(double width, double depth, double laser_height)
      : width_(width), depth_(depth), laser_height_(laser_height) {}

  double width() const { return width_; }
  double depth() const { return depth_; }
  const std::vector<Shape>& walls() const { return walls_; }
  const std::vector<Shape>& furniture() const { return furniture_; }

  /// `glass`: one wall returns every few beams only.
  void add_walls(bool glass, Random& random);
  void add_chair(const Eigen::Vector2d& at, double yaw, Random& random);
  void add_table(const Eigen::Vector2d& at, Random& random);
  /// A pole or a bin.
  void add_round(const Shape& shape);
  void add_box(Random& random);
  /// Where nobody goes; m.
  void add_obstacle(const Eigen::Vector2d& center, double radius) { obstacles_.push_back({center, radius}); }

  Eigen::Vector2d place(Random& random) const;
  /// With `clearance` m to walls and obstacles.
  bool is_free(const Eigen::Vector2d& p, double clearance) const;
  Pose2 free_pose(Random& random) const;
  /// A place that can be reached straight on.
  std::optional<Eigen::Vector2d> next_target(const Eigen::Vector2d& from, double clearance,
                                             Random& random) const;

 private:
  struct Obstacle {
    Eigen::Vector2d center;
    double radius;
  };
  void add_doorway(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double visible, Random& random);
  void add_five_feet(const Pose2& pose, Random& random);
  bool path_is_free(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double clearance) const;

  double width_, depth_, laser_height_;
  std::vector<Shape> walls_, furniture_;
  std::vector<Obstacle> obstacles_;
};

}  // namespace parhelion::test

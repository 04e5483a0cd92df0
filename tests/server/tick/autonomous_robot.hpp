// In place of a real autonomous robot: it knows only its map, its pose and its scans. It follows a path
// until that is blocked, stops for crossing objects, and drives around standing ones.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "server/simulation/building/route_search.hpp"

namespace parhelion::test {

class AutonomousRobot {
 public:
  static constexpr double kAcceleration = 1.0;  ///< m/s^2
  static constexpr double kPeriod = 0.1;        ///< s between two scans

  /// `speed`: m/s on a free path.
  AutonomousRobot(const RobotDescription& robot, const std::shared_ptr<const simulation::Building>& building,
                  const Eigen::Vector2d& goal, double speed);

  /// Its next command, from a scan taken at `pose`, while it moves with `current_twist`.
  Twist2 drive(const Pose2& pose, const Twist2& current_twist, const Scan& scan);

 private:
  using Points = std::vector<Eigen::Vector2d>;  ///< m, map
  Points unmapped(const Pose2& pose, const Scan& scan);
  void watch(const Points& seen);
  void remember(const Pose2& pose, const Scan& scan, const Points& seen);
  void plan(const Pose2& pose);
  bool path_is_blocked(const Pose2& pose) const;
  Twist2 follow_path(const Pose2& pose, double speed) const;
  double gap(const Pose2& pose, const Points& things, const Eigen::Vector2d& displacement) const;
  double min_gap(Pose2 pose, Twist2 twist, double speed, const Points& things) const;

  LaserDescription laser_;
  Eigen::AlignedBox2d outline_;
  simulation::RouteGrid grid_;
  Eigen::Vector2d goal_;
  double speed_;
  Points path_;
  std::uint32_t searches_ = 0;
  double t_ = 0, planned_ = -10, stood_since_ = 0;  // s
  struct Edges {
    double t;
    Eigen::Vector2d first, last;
  };
  std::deque<Edges> edges_;                                      // of seen objects, in the last half second
  Eigen::Vector2d obstacle_velocity_ = Eigen::Vector2d::Zero();  // m/s, map; zero unless it moves
  bool obstacle_moves_ = false;
  std::map<std::pair<long, long>, Eigen::Vector2d> remembered_;  // one point of each cell
};

}  // namespace parhelion::test

// Drives to a goal around what a laser sees: for a robot that drives itself.
#pragma once

#include <vector>

#include "geometry.hpp"

namespace robot {

class Route {
 public:
  struct Settings {
    Polygon footprint;
    double speed = 0.5;     // m/s on a free path
    double yaw_rate = 1.0;  // rad/s
    double gap = 0.12;      // m wanted beside the outline
    double reached = 0.25;  // m from a point of the route
  };
  // `points`: to pass one after the other, the goal last; in the frame of the poses.
  Route(const Settings& settings, std::vector<Point2> points);

  // The next command. `seen`: ends of the beams of the newest scan; `now`: the present motion. All in one
  // frame.
  Twist2 drive(const Pose2& pose, const Twist2& now, const std::vector<Point2>& seen);
  bool is_reached() const { return next_ == points_.size(); }
  // Why the last command was a stop; empty: it was not.
  const char* reason() const { return reason_; }

 private:
  std::vector<Point2> path(const Pose2& pose, const std::vector<Point2>& seen, double clearance) const;
  Twist2 follow(const std::vector<Point2>& path, const Pose2& pose, double speed) const;
  double gap(const Pose2& at, const std::vector<Point2>& seen) const;
  Twist2 escape(const Pose2& pose, const std::vector<Point2>& seen) const;
  bool is_safe(const std::vector<Point2>& path, Pose2 pose, Twist2 now, double speed,
               const std::vector<Point2>& seen, double min_gap) const;

  Settings settings_;
  std::vector<Point2> points_;
  std::size_t next_ = 0;
  double radius_ = 0;  // m, of the footprint about its origin
  int blocked_ = 0;    // commands in a row that were a stop
  const char* reason_ = "";
};

}  // namespace robot

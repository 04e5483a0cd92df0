// Two driven wheels that slip, and the encoders on them.
#pragma once

#include <random>

#include "building.hpp"

namespace robot {

class Chassis {
 public:
  // `slip`: 1 sigma of the fraction of a wheel's turn that does not move the robot.
  Chassis(const Pose2& T_site_base, double slip, unsigned seed)
      : T_site_base_(T_site_base), slip_(slip), random_(seed) {}

  // Accelerates towards `command` for `dt` s. An obstacle stops it.
  void step(const Twist2& command, double dt, const Building& building);

  // The true pose, which no real robot knows.
  const Pose2& T_site_base() const { return T_site_base_; }
  // As the motors turn, without slip.
  const Twist2& twist() const { return twist_; }
  // By the encoders, since the robot was switched on. Call it at a fixed rate.
  Pose2 odometry();
  // How often it has touched something.
  int bumps() const { return bumps_; }
  double driven() const { return driven_; }  // m

 private:
  struct Wheel {
    double turned = 0;  // rad
    double slip = 0;    // fraction
    long ticks = 0;     // of the encoder, at the last odometry
  };
  double rolled(Wheel& wheel, double speed, double dt);  // m over the floor
  double measured(Wheel& wheel);                         // m since the last odometry

  Pose2 T_site_base_, T_odom_base_;
  Twist2 twist_;
  Wheel left_, right_;
  double slip_;
  std::mt19937 random_;
  bool blocked_ = false;
  int bumps_ = 0;
  double driven_ = 0;
};

}  // namespace robot

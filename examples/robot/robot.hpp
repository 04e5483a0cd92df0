// The robot on the bus: what it publishes, what it obeys, and when.
#pragma once

#include <csignal>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "arm.hpp"
#include "chassis.hpp"
#include "command_watch.hpp"
#include "laser.hpp"
#include "obstacles.hpp"
#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/pose_cov_t.hpp"
#include "parhelion/twist2D_t.hpp"
#include "route.hpp"

namespace robot {

struct Options {
  std::string building = "building.txt", description = "robot.yaml";
  double slip = 0.02;           // fraction, 1 sigma
  double clock_offset = 0;      // s, this robot's clock ahead of the machine's
  double odometry_late = 0.01;  // s, encoders are read this long before the stamp of ODOMETRY
  double image_rate = 2;        // Hz, 0: no cameras
  unsigned seed = 1;
  bool truth = false;         // publish the true pose on REFERENCE_POSE, as a motion capture system could
  double speed = 0.5;         // m/s, of a robot that drives itself
  std::vector<Point2> route;  // map; not empty: it drives itself on MR_SCAN, and obeys MR_CMD's stops alone
};

class Robot {
 public:
  // Throws std::runtime_error where a file cannot be read.
  Robot(lcm::LCM& bus, const Options& options);
  // Until `end` is set.
  void run(const volatile std::sig_atomic_t& end);
  // JSON, one line.
  std::string summary() const;

 private:
  void handle_command(const lcm::ReceiveBuffer*, const std::string&, const parhelion::twist2D_t* command);
  void handle_scan(const lcm::ReceiveBuffer*, const std::string&, const parhelion::planar_lidar_t* scan);
  void handle_pose(const lcm::ReceiveBuffer*, const std::string&, const parhelion::pose_cov_t* pose);
  void handle_joint_command(const lcm::ReceiveBuffer*, const std::string&,
                            const parhelion::joints_t* command);

  std::int64_t now() const;  // us, this robot's clock
  void step(std::int64_t now);
  void publish_at(std::int64_t now);
  void publish_scan(std::int64_t now);
  void publish_odometry(std::int64_t now);
  void publish_truth(std::int64_t now);
  std::optional<Pose2> T_map_base(std::int64_t utime) const;
  void steer(const parhelion::planar_lidar_t& scan, std::int64_t now);

  lcm::LCM& bus_;
  Options options_;
  Building building_;
  std::string description_;
  Chassis chassis_;
  Arm arm_;
  CommandWatch watch_;
  ObstacleStop obstacles_;
  Track truth_, odometry_;
  std::mt19937 random_;
  std::int64_t steps_ = 0;
  std::int64_t scans_ = 0, obstacle_stops_ = 0, refused_ = 0;
  bool held_ = false;  // by the obstacle stop

  // Of a robot that drives itself.
  std::optional<Route> route_;
  std::optional<Pose2> T_map_odom_;
  std::int64_t localized_ = 0;  // stamp of the newest pose
  Twist2 steering_;
  std::int64_t steered_ = 0;
  std::string waits_for_;
};

}  // namespace robot

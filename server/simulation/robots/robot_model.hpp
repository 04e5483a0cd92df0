// A completely simulated robot: links, joints, wheels and tracks, sensors. From URDF, with an additional YAML
// file for what URDF cannot express.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/robot.hpp"
#include "protocols/scene.hpp"
#include "protocols/status.hpp"

namespace parhelion::simulation {

/// A rigid part; its frame is that of its parent joint (URDF), for the first link base_link: on the floor,
/// between wheels or tracks.
struct RobotLink {
  std::string name;
  double mass = 0;  ///< kg, > 0; 0 only for a link fixed to another (a sensor's frame)
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of mass, m, link frame
  Eigen::Matrix3d inertia =
      Eigen::Matrix3d::Identity();  ///< kg m^2, about the centre of mass, axes of the link
  std::vector<Shape> visible;       ///< what lasers hit and cameras see
  std::vector<Shape> solid;         ///< what collides
  double friction = 0.6;            ///< of the collision shapes, against anything; runners have the drive's
};

enum class JointKind : std::uint8_t { fixed, revolute, continuous, prismatic };

struct RobotJoint {
  std::string name;
  JointKind kind = JointKind::fixed;
  std::size_t parent = 0, child = 0;                ///< links
  Transform<Body, Body> T_parent_child;             ///< at position 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit, in the child's frame
  double lower = 0, upper = 0;                      ///< rad or m; of revolute and prismatic joints
  double velocity = 1;                              ///< rad/s or m/s, maximum
  double effort = 10;                               ///< N m or N, maximum of its motor
  double friction = 0, damping = 0;                 ///< N m or N; N m s/rad or N s/m
  double break_effort = 0;            ///< N m or N of load across the joint that breaks it; 0: never
  double start = 0;                   ///< rad or m at the spawn
  std::optional<std::size_t> geared;  ///< the joint it mimics (URDF: mimic)
  double gear_ratio = 1;              ///< its position is gear_ratio * that of the other + gear_offset; not 0
  double gear_offset = 0;             ///< rad or m
};

enum class DriveKind : std::uint8_t { differential, skid, ackermann, tracked };

/// A rolling surface: a wheel, or a track around its link.
struct RobotRunner {
  enum class Kind : std::uint8_t { wheel, track };
  Kind kind = Kind::wheel;
  std::size_t link = 0;  ///< the wheel, or the link inside the track
  double radius = 0.1;   ///< m, of a wheel
  int side = 0;          ///< +1 left, -1 right
  bool driven = true;
  std::optional<std::size_t> steering;  ///< joint that steers it (Ackermann)
};

struct RobotDrive {
  DriveKind kind = DriveKind::differential;
  std::vector<RobotRunner> runners;
  double track = 0.4;       ///< m, between left and right, as used by the drive
  double wheelbase = 0.5;   ///< m, for Ackermann: from the fixed axle to the steered one
  double acceleration = 1;  ///< m/s^2, of the runners' surface
  double force = 100;       ///< N, maximum of one runner's motor at its surface
  double friction = 0.8;    ///< of its surface against the floor
};

struct RobotModel {
  std::string name;                ///< of the model: "rover"; used by scenarios and commands
  RobotDescription description;    ///< sensors, footprint, limits, as for a real robot
  std::vector<RobotLink> links;    ///< parents before children; the first is base_link
  std::vector<RobotJoint> joints;  ///< one fewer than links; joints[i].child == i + 1
  RobotDrive drive;
  AttitudeLimits attitude;
  std::vector<std::string> bumpers;   ///< links whose contacts a sensor reports
  std::vector<std::string> gripper;   ///< links that grip
  std::string urdf, yaml;             ///< source texts, embedded in MR_SESSION; the URDF with its meshes
  std::vector<std::string> warnings;  ///< what was left out of the URDF, and why; for people
};

/// Positions (rad or m) and velocities of all joints of a robot model, in its order.
struct JointPosture {
  std::vector<double> positions, velocities;
};

/// Parses both texts (YAML: schema robot_model.schema.json). Errors name file and line, for example: a joint
/// loop, a mass that is not positive, a missing mesh, a wheel without link.
Result<RobotModel> parse_robot_model(const std::string& urdf, const std::string& yaml,
                                     const std::string& origin);
/// A shipped model by name (server/robots), or the path of a YAML file with its URDF and meshes
/// (embed_meshes()).
Result<RobotModel> load_robot_model(const std::string& name_or_path);
/// Names of the shipped models, ascending.
std::vector<std::string> shipped_robot_models();

}  // namespace parhelion::simulation

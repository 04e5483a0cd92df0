// SLAM on raw scans and odometry: localization in a frozen map, or mapping. The engine is Parhelion's own
// (own_slam.hpp) or one of MRPT's (mrpt/engines.hpp).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"
#include "fusion/pose/matching/sweep_motion.hpp"
#include "fusion/pose/odometry/odometry_sanity.hpp"
#include "protocols/joints.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion::pose {

enum class SlamEngine : std::uint8_t {
  parhelion,          ///< maps with loop closing, and localizes
  mrpt_icp,           ///< maps without loop closing
  mrpt_rbpf,          ///< maps with a particle filter
  mrpt_localization,  ///< localizes with a particle filter
};
const char* to_string(SlamEngine engine);
/// nullopt: no engine has that name.
std::optional<SlamEngine> slam_engine(const std::string& name);
std::vector<std::string> slam_engines();

struct SlamOptions {
  SlamEngine engine = SlamEngine::parhelion;
  std::string engine_config;  ///< a configuration file of MRPT, for its engines; empty: defaults of our own
  std::uint64_t seed = 1;
  std::optional<Eigen::Vector3d> start;  ///< x, y, yaw in the map; without it: global localization
  /// False: the robot reports none, and scans alone show how it moves.
  bool has_odometry = true;
  double resolution = 0.05;  ///< m, of a map being built, or made from a .simplemap
  /// Unsure while the laser may be mounted backward or upside down, and its beams in the order that scans
  /// show; false for who calibrates.
  bool doubt_mounting = true;
  std::function<void(double)> progress;  ///< 0..1, called while finish() closes loops
  /// Of recordings, for Parhelion's engine: the base's motion during the sweep of the scan with that stamp,
  /// known from before and after. Empty, or nullopt: by the odometry that has arrived.
  std::function<std::optional<SweepMotion>(SensorTime)> sweep_motion;
};

/// s, to add to odometry's stamps: then they are on the clock of the scans; and 1 sigma.
struct ClockOffset {
  double seconds = 0, sigma = 0;
};

/// Causal: each estimate uses only the input up to its scan.
class Slam {
 public:
  virtual ~Slam() = default;
  virtual void add(const Odometry& odometry) = 0;
  /// Roll and pitch are taken out of scans. Without samples, or without an `imu` in the description, the
  /// robot counts as level.
  virtual void add_inertial(const ImuSample&) {}
  /// The estimate for this scan; nullopt where there is none yet (before the first odometry, or of a robot
  /// that has none, before the first scan with returns). Global
  /// localization returns estimates with state initializing until it has converged.
  virtual std::optional<PoseEstimate> add(const Scan& scan) = 0;
  /// Mapping: closes the remaining loops and returns the final trajectory (causal = false), one pose per
  /// processed scan.
  virtual std::vector<PoseEstimate> finish() = 0;
  /// What was found to be wrong with odometry so far; always empty with an engine of MRPT.
  virtual std::vector<OdometryFinding> odometry_findings() const { return {}; }
  /// As a map that was built shows it; it was not applied. nullopt: the drive has not shown it.
  virtual std::optional<ClockOffset> odometry_offset() const { return std::nullopt; }
  /// Of the scan that was added last, where SlamOptions::has_odometry is false.
  virtual std::optional<Odometry> odometry_by_scans() const { return std::nullopt; }
  virtual GridMap grid_map() const = 0;
  /// MRPT's .simplemap (mapping only).
  virtual Status save_simplemap(const std::string& path) const = 0;
};

Result<std::unique_ptr<Slam>> make_mapper(const RobotDescription& robot, const SlamOptions& options);
/// `map_path`: .simplemap or ROS map YAML.
Result<std::unique_ptr<Slam>> make_localizer(const RobotDescription& robot, const std::string& map_path,
                                             const SlamOptions& options);

}  // namespace parhelion::pose

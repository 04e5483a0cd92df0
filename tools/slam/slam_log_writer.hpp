// Writes a log with SLAM's estimates merged into its events. Internal to slam_log*.cpp.
#pragma once

#include <span>

#include "protocols/robot.hpp"
#include "tools/slam/slam_report.hpp"

namespace parhelion::tools {

/// Estimates in order of arrival, at least one.
struct SlamTrajectory {
  std::span<const SlamOutput> outputs;
  const RobotDescription& robot;
  bool mapping = false, causal = true;
  std::string map_id;
};

/// Writes options.output: the events of options.input merged with the estimates by arrival time. Writes a
/// temporary file and renames it. Returns the number of input events that the estimates replace.
Result<std::uint64_t> write_slam_log(const SlamLogOptions& options, const SlamTrajectory& trajectory);

}  // namespace parhelion::tools

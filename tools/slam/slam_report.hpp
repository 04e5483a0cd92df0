// Statistics of SLAM's estimates. Internal to slam_log*.cpp.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>

#include "tools/slam/slam_log.hpp"

namespace parhelion::tools {

/// An estimate of SLAM and its arrival time at the server.
struct SlamOutput {
  ArrivalTime arrival;
  PoseEstimate estimate;
  std::optional<Odometry> odometry;  ///< made of the scans, where the robot reports none
};

/// Counts answered, tracking, lost and initializing.
void count(std::span<const SlamOutput> outputs, SlamLogReport& report);

/// As in the summaries of slam and calibrate: fault, since_s and until_s (null: it lasts), text.
nlohmann::ordered_json faults_json(std::span<const pose::OdometryFinding> findings, SensorTime first_scan);

/// One line for people.
std::string summary_line(const SlamLogReport& report);

}  // namespace parhelion::tools

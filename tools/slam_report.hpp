// What is counted over SLAM's words, and said. Internal to slam_log*.cpp.
#pragma once

#include <span>

#include "tools/slam_log.hpp"

namespace parhelion::tools {

/// A word of SLAM and when it reaches the server.
struct SlamWord {
  ArrivalTime arrival;
  PoseEstimate estimate;
};

/// Fills answered, tracking, lost and initializing.
void count(std::span<const SlamWord> words, SlamLogReport& report);

/// One line for people.
std::string summary_line(const SlamLogReport& report);

}  // namespace parhelion::tools

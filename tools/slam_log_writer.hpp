// A log with SLAM's words among its events. Internal to slam_log*.cpp.
#pragma once

#include <span>

#include "protocols/robot.hpp"
#include "tools/slam_report.hpp"

namespace parhelion::tools {

/// What is to be written: words in order of arrival, at least one.
struct SlamWords {
  std::span<const SlamWord> words;
  const RobotDescription& robot;
  bool mapping = false, causal = true;
  std::string map_id;
};

/// Writes options.output: the events of options.input, and the words where they arrive. Beside it first, then
/// in its place. Returns how many events of the input the output does not hold, because these words replace
/// them.
Result<std::uint64_t> write_slam_log(const SlamLogOptions& options, const SlamWords& said);

}  // namespace parhelion::tools

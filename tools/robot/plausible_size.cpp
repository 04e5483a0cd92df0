#include "tools/robot/plausible_size.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "protocols/length_text.hpp"

namespace parhelion::tools {
namespace {

constexpr double kLargest = 5, kSmallest = 0.05;  // m
constexpr double kMaxTurns = 1.1;                 // of a laser in one scan

constexpr const char* kMillimetres =
    "; were these millimetres? A URDF is in metres, and a mesh in millimetres needs scale=\"0.001 0.001 "
    "0.001\"";

}  // namespace

std::vector<std::string> implausible_values(const RobotDescription& robot) {
  std::vector<std::string> found;
  const auto add = [&](const std::string& what) { found.push_back(what + kMillimetres); };
  if (robot.footprint.size() >= 3) {
    Eigen::Vector2d low = robot.footprint.front(), high = low;
    for (const Eigen::Vector2d& corner : robot.footprint) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
    const Eigen::Vector2d size = high - low;
    const std::string text = "footprint: " + length_text(size.x()) + " x " + length_text(size.y());
    if (size.maxCoeff() > kLargest) add(text + ", larger than mobile robots are");
    if (size.maxCoeff() < kSmallest)
      found.push_back(text + ", smaller than mobile robots are; were these metres, taken for millimetres?");
  }
  if (robot.height > kLargest)
    add("height: " + length_text(robot.height) + ", higher than mobile robots are");
  const auto check_laser = [&](const std::string& key, const LaserDescription& laser) {
    const double away = laser.T_base_laser.translation().norm();
    if (away > kLargest) add(key + " pose: " + length_text(away) + " from base_link");
    const double turns = std::abs(laser.angle_increment) * laser.beams / (2 * std::numbers::pi);
    char text[160];
    std::snprintf(text, sizeof text, "%s angle_increment: %d beams make %.3g turns; were these degrees?",
                  key.c_str(), laser.beams, turns);
    if (turns > kMaxTurns) found.emplace_back(text);
  };
  if (robot.laser) check_laser("laser", *robot.laser);
  for (const NamedLaser& each : robot.further_lasers) check_laser("lasers, '" + each.name + "'", each.laser);
  return found;
}

}  // namespace parhelion::tools

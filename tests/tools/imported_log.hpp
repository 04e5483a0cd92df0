// Imports into a temporary folder and reads the log back; shared by the import tests.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/quantile.hpp"
#include "protocols/robot.hpp"
#include "tests/recordings.hpp"
#include "tools/import/import.hpp"

namespace parhelion::test {

struct ImportedLog {
  std::vector<Message> events;

  explicit ImportedLog(const std::filesystem::path& path) {
    auto reader = LogReader::open(path.string());
    EXPECT_TRUE(reader.ok()) << (reader.ok() ? "" : reader.error().message);
    if (!reader) return;
    for (;;) {
      auto next = reader->next();
      EXPECT_TRUE(next.ok()) << (next.ok() ? "" : next.error().message);
      if (!next || !next->has_value()) break;
      events.push_back(std::move(**next));
    }
  }

  template <class T>
  std::vector<T> all(const std::string& channel) const {
    std::vector<T> items;
    for (const Message& event : events) {
      if (event.channel != channel) continue;
      const Status decoded = decode(channel, event.payload, items.emplace_back());
      EXPECT_TRUE(decoded.ok()) << (decoded.ok() ? "" : decoded.error().message);
    }
    return items;
  }

  /// The description in the first event.
  RobotDescription robot() const {
    if (events.empty() || events[0].channel != channel::kRobot) {
      ADD_FAILURE() << "the log does not start with ROBOT";
      return {};
    }
    RobotMessage message;
    EXPECT_TRUE(decode(channel::kRobot, events[0].payload, message).ok());
    auto robot = parse_robot_description(message.yaml, "ROBOT");
    EXPECT_TRUE(robot.ok()) << (robot.ok() ? "" : robot.error().message) << "\n" << message.yaml;
    return robot ? *robot : RobotDescription{};
  }

  void expect_arrivals_increase() const {
    for (std::size_t i = 1; i < events.size(); ++i) {
      ASSERT_LT(events[i - 1].arrival, events[i].arrival) << "event " << i << " on " << events[i].channel;
    }
  }
};

inline tools::ImportOptions import_options(const std::filesystem::path& input,
                                           const std::filesystem::path& output) {
  tools::ImportOptions options;
  options.input = input;
  options.output = output;
  return options;
}

inline std::vector<char> file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void write_bytes(const std::filesystem::path& path, const std::vector<char>& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  write_bytes(path, {text.begin(), text.end()});
}

/// Hits of a scan in frame A, within `far` of the laser.
template <class A>
std::vector<Eigen::Vector2d> hits(const Scan& scan, const RangeConvention& convention,
                                  const Transform<A, Laser>& T_a_laser, double far) {
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const double range = scan.ranges[i];
    if (convention.classify(scan.ranges[i]) != BeamKind::hit || range > far) continue;
    const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
    const Eigen::Vector3d p =
        T_a_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
    points.emplace_back(p.x(), p.y());
  }
  return points;
}

/// Median distance from the points of one scan to the nearest points of the other: small if both see the same
/// walls.
inline double median_distance(const std::vector<Eigen::Vector2d>& from,
                              const std::vector<Eigen::Vector2d>& to) {
  std::vector<double> distances;
  for (const Eigen::Vector2d& p : from) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& q : to) nearest = std::min(nearest, (p - q).squaredNorm());
    distances.push_back(std::sqrt(nearest));
  }
  if (distances.empty()) return std::numeric_limits<double>::infinity();
  return median(distances);
}

/// The scan with its beams in reverse order, as a wrong sense of rotation would give.
inline Scan mirrored(Scan scan) {
  std::reverse(scan.ranges.begin(), scan.ranges.end());
  return scan;
}

}  // namespace parhelion::test

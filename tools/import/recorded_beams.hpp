// In which order of time the lasers of a recording measure their beams. Most sources do not say it truly: a
// driver that sorts the beams of a laser that turns clockwise calls the last one the first.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fusion/pose/matching/beam_order.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::tools {

class RecordedBeams {
 public:
  explicit RecordedBeams(const RobotDescription& robot);

  /// Messages of the recording, in its order.
  void add(const Odometry& odometry);
  void add(std::string_view channel, const Scan& scan);

  /// The description with the lasers whose beams were measured in another order, each said in `notes`;
  /// nullopt: scans have shown none.
  std::optional<RobotDescription> corrected(std::vector<std::string>& notes) const;

 private:
  struct Laser {
    std::string channel;
    pose::ScanOdometry odometry;
    pose::BeamOrder order;
  };
  RobotDescription robot_;
  std::vector<Laser> lasers_;  ///< as RobotDescription::laser_at counts them
};

}  // namespace parhelion::tools

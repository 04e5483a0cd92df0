// In which order of time the lasers of a recording measure their beams, and which of them is at the stamp.
// Most sources do not say it truly: a driver that sorts the beams of a laser that turns clockwise calls the
// last one the first, and many take the time when a scan arrives for that of its first beam.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fusion/pose/matching/beam_order.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "protocols/pose.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "tools/arrivals.hpp"

namespace parhelion::tools {

class RecordedBeams {
 public:
  explicit RecordedBeams(const RobotDescription& robot);

  /// Messages of the recording, in its order.
  void add(const Odometry& odometry, ArrivalTime arrival);
  void add(std::string_view channel, const Scan& scan, ArrivalTime arrival);

  /// The description with the lasers whose beams were measured in another order, or whose stamps are those of
  /// the last beam (is_stamped_at_arrival), each said in `notes`; nullopt: the recording shows none.
  std::optional<RobotDescription> corrected(std::vector<std::string>& notes) const;

 private:
  struct Laser {
    std::string channel;
    pose::ScanOdometry odometry;
    pose::BeamOrder order;
    Arrivals arrivals;
    std::size_t beams = 0;   ///< of the first scan
    bool own_times = false;  ///< a scan has the times or angles of its beams
  };
  RobotDescription robot_;
  Arrivals odometry_;
  std::vector<Laser> lasers_;  ///< as RobotDescription::laser_at counts them
};

}  // namespace parhelion::tools

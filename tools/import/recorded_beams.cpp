#include "tools/import/recorded_beams.hpp"

#include <cstddef>
#include <cstdio>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"

namespace parhelion::tools {

using pose::BeamOrder;

RecordedBeams::RecordedBeams(const RobotDescription& robot) : robot_(robot) {
  if (!robot.laser) return;
  lasers_.push_back({channel::kScan, pose::ScanOdometry(), BeamOrder(*robot.laser)});
  for (const auto& [name, laser] : robot.further_lasers)
    lasers_.push_back({sensor_channel(channel::kScan, name), pose::ScanOdometry(), BeamOrder(laser)});
}

void RecordedBeams::add(const Odometry& odometry) {
  for (Laser& laser : lasers_) {
    if (laser.order.verdict() == BeamOrder::Verdict::unknown) laser.odometry.add(odometry);
  }
}

void RecordedBeams::add(std::string_view channel, const Scan& scan) {
  for (std::size_t i = 0; i < lasers_.size(); ++i) {
    Laser& laser = lasers_[i];
    if (laser.channel != channel || laser.order.verdict() != BeamOrder::Verdict::unknown) continue;
    const auto step = laser.odometry.step_to(scan, robot_.laser_at(i));
    laser.order.add(scan, step && step->known ? std::optional(step->step) : std::nullopt);
  }
}

std::optional<RobotDescription> RecordedBeams::corrected(std::vector<std::string>& notes) const {
  std::optional<RobotDescription> result;
  for (std::size_t i = 0; i < lasers_.size(); ++i) {
    if (!lasers_[i].order.differs()) continue;
    if (!result) result = robot_;
    LaserDescription& laser = i == 0 ? *result->laser : result->further_lasers[i - 1].laser;
    lasers_[i].order.correct(laser);
    char text[64];
    std::snprintf(text, sizeof text, ": beam_interval is %.6g s", laser.beam_interval);
    notes.push_back(lasers_[i].channel + ": the source describes it otherwise, but " +
                    lasers_[i].order.what() + text);
  }
  return result;
}

}  // namespace parhelion::tools

#include "tools/import/recorded_beams.hpp"

#include <cstddef>
#include <cstdio>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"

namespace parhelion::tools {

using pose::BeamOrder;

RecordedBeams::RecordedBeams(const RobotDescription& robot) : robot_(robot) {
  if (!robot.laser) return;
  lasers_.push_back({channel::kScan, pose::ScanOdometry(), BeamOrder(*robot.laser), {}});
  for (const auto& [name, laser] : robot.further_lasers)
    lasers_.push_back({sensor_channel(channel::kScan, name), pose::ScanOdometry(), BeamOrder(laser), {}});
}

void RecordedBeams::add(const Odometry& odometry, ArrivalTime arrival) {
  odometry_.add(odometry.stamp, arrival);
  for (Laser& laser : lasers_) {
    if (laser.order.verdict() == BeamOrder::Verdict::unknown) laser.odometry.add(odometry);
  }
}

void RecordedBeams::add(std::string_view channel, const Scan& scan, ArrivalTime arrival) {
  for (std::size_t i = 0; i < lasers_.size(); ++i) {
    Laser& laser = lasers_[i];
    if (laser.channel != channel) continue;
    laser.arrivals.add(scan.stamp, arrival);
    if (laser.beams == 0) laser.beams = scan.ranges.size();
    laser.own_times = laser.own_times || !scan.times.empty() || !scan.angles.empty();
    if (laser.order.verdict() != BeamOrder::Verdict::unknown) continue;
    const auto step = laser.odometry.step_to(scan, robot_.laser_at(i));
    laser.order.add(scan, step && step->known ? std::optional(step->step) : std::nullopt);
  }
}

std::optional<RobotDescription> RecordedBeams::corrected(std::vector<std::string>& notes) const {
  RobotDescription result = robot_;
  bool differs = false;
  for (std::size_t i = 0; i < lasers_.size(); ++i) {
    const Laser& recorded = lasers_[i];
    LaserDescription& laser = i == 0 ? *result.laser : result.further_lasers[i - 1].laser;
    const std::string start = recorded.channel + ": the source describes the laser differently, but ";
    if (recorded.order.differs()) {
      differs = true;
      recorded.order.correct(laser);
      char text[64];
      std::snprintf(text, sizeof text, ": beam_interval is %.6g s", laser.beam_interval);
      notes.push_back(start + recorded.order.what() + text);
    }
    const ScanArrival arrival = scan_arrival(recorded.arrivals, odometry_);
    if (has_another_clock(arrival))
      notes.push_back(recorded.channel + ": " + clock_advice(*arrival.odometry_lag));
    if (recorded.own_times) continue;
    const auto early = early_arrival(laser, recorded.beams, arrival);
    if (!early) continue;
    if (!is_stamped_at_arrival(laser, recorded.beams, arrival)) {
      notes.push_back(recorded.channel + " " + stamp_beam_advice(*early));
      continue;
    }
    differs = true;
    laser.stamp_beam = LaserDescription::StampBeam::last;
    char text[160];
    std::snprintf(text, sizeof text,
                  "scans arrive %.4g ms before their last beam would be measured; the driver probably takes "
                  "the time when a scan arrives: stamp_beam is last",
                  1e3 * *early);
    notes.push_back(start + text);
  }
  if (!differs) return std::nullopt;
  return result;
}

}  // namespace parhelion::tools

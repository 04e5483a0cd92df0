#include "tools/calibration/calibration_failure.hpp"

#include <cmath>
#include <cstdio>

#include "protocols/angle_units.hpp"
#include "tools/calibration/calibration_verdict.hpp"

namespace parhelion::tools {
namespace {

using Kind = RecordedDrive::Event::Kind;

/// Sums of absolute values.
struct Travel {
  double driven = 0, turned = 0;  ///< m, rad
  bool moves() const { return driven > 1 || turned > 0.5; }

  void add(const Pose2& step) {
    if (!step.finite()) return;
    driven += step.position().norm();
    turned += std::abs(step.yaw);
  }
};

Travel by_odometry(const RecordedDrive& drive) {
  Travel travel;
  const Odometry* last = nullptr;
  for (const RecordedDrive::Event& event : drive.events) {
    if (event.kind != Kind::odometry) continue;
    const Odometry& now = drive.odometry[event.index];
    if (last) travel.add(planar(last->T_odom_base).inverse() * planar(now.T_odom_base));
    last = &now;
  }
  return travel;
}

Travel by_scans(const std::vector<pose::LaserPose>& poses) {
  Travel travel;
  // Over a second, as each pose has an error of its own.
  const pose::LaserPose* last = nullptr;
  for (const pose::LaserPose& pose : poses) {
    if (last && (pose.stamp - last->stamp).seconds() < 1) continue;
    if (last) travel.add(last->T_map_laser.inverse() * pose.T_map_laser);
    last = &pose;
  }
  return travel;
}

/// Of all beams, those with a return.
double fraction_of_returns(const RecordedDrive& drive, const LaserDescription& laser) {
  double hits = 0, beams = 0;
  for (const RecordedDrive::Event& event : drive.events) {
    if (event.kind != Kind::scan) continue;
    for (const float range : drive.scans[event.index].ranges) {
      hits += laser.convention.classify(range) == BeamKind::hit ? 1 : 0;
      ++beams;
    }
  }
  return beams > 0 ? hits / beams : 0;
}

std::string text_of(const RecordedDrive& drive, const TrackedDrive& tracked, const LaserDescription& laser,
                    const CalibrationOptions& options) {
  constexpr std::size_t kMinPoses = 30;
  char text[400];
  text[0] = 0;
  const Travel odometry = by_odometry(drive), scans = by_scans(tracked.motion.laser);
  const std::size_t placed = tracked.motion.laser.size();
  if (tracked.scans < kMinPoses) {
    std::snprintf(text, sizeof text, "%zu scans, but %zu are needed: drive for longer", tracked.scans,
                  kMinPoses);
  } else if (placed < kMinPoses && !options.map.empty()) {
    std::snprintf(text, sizeof text, "%zu of %zu scans fit %s: is it the map of this place?", placed,
                  tracked.scans, options.map.string().c_str());
  } else if (placed < kMinPoses) {
    std::snprintf(
        text, sizeof text,
        "%zu of %zu scans show where the robot is; %.0f %% of their beams have a return: drive where "
        "walls are within the laser's range",
        placed, tracked.scans, 100 * fraction_of_returns(drive, laser));
  } else if (!scans.moves() && odometry.moves()) {
    std::snprintf(text, sizeof text,
                  "odometry drives %.1f m and turns %.0f deg, but the scans stand still: does the laser see "
                  "the room, and is the robot on its wheels?",
                  odometry.driven, kDegreesPerRadian * odometry.turned);
  } else if (!scans.moves()) {
    std::snprintf(text, sizeof text,
                  "the robot stands: odometry drives %.2f m and turns %.1f deg in %zu scans; drive it, "
                  "straight and with turns both ways",
                  odometry.driven, kDegreesPerRadian * odometry.turned, tracked.scans);
  }
  return text;
}

}  // namespace

Error why_nothing_is_shown(const Error& error, const RecordedDrive& drive, const TrackedDrive& tracked,
                           const LaserDescription& laser, const CalibrationOptions& options,
                           SensorTime first_scan) {
  const std::string text = text_of(drive, tracked, laser, options);
  return {(text.empty() ? error.message : text) + known_faults(tracked, first_scan)};
}

}  // namespace parhelion::tools

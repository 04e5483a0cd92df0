#include "tools/robot/check_description.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "fusion/pose/matching/beam_order.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/length_text.hpp"

namespace parhelion::tools {
namespace {

constexpr double kRare = 1e-3;  // fraction of ranges that may be damage
constexpr double kSelf = 0.8;   // fraction of scans in which a beam sees the robot itself
constexpr double kPeriodError = 0.1;

std::string percent(double fraction) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100 * fraction);
  return text;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

/// Whether a point (base_link) is inside a convex outline, counter-clockwise.
bool inside(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& point) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d edge = outline[(i + 1) % outline.size()] - outline[i], to = point - outline[i];
    if (edge.x() * to.y() - edge.y() * to.x() < 0) return false;
  }
  return outline.size() >= 3;
}

class Checker {
 public:
  Checker(const RobotDescription& robot, const LogSurvey& log) : robot_(robot), log_(log) {}

  DescriptionCheck run() {
    check_presence();
    check_clocks();
    if (robot_.laser && log_.laser) {
      check_form(*robot_.laser, *log_.laser);
      check_times(*robot_.laser, *log_.laser);
      check_ranges(*robot_.laser, *log_.laser);
      check_self(*robot_.laser, *log_.laser);
      check_turn(*robot_.laser, *log_.laser);
      check_stamp_beam(channel::kScan, *robot_.laser, *log_.laser);
      check_beam_order(channel::kScan, *robot_.laser, *log_.laser);
    }
    for (const NamedLaser& laser : robot_.further_lasers) {
      const std::string name = sensor_channel(channel::kScan, laser.name);
      const auto seen = log_.further_lasers.find(name);
      if (seen == log_.further_lasers.end()) continue;
      check_stamp_beam(name, laser.laser, seen->second);
      check_beam_order(name, laser.laser, seen->second);
    }
    if (robot_.camera && log_.camera) check_size("camera", robot_.camera->intrinsics, *log_.camera);
    if (robot_.depth && log_.depth) check_size("depth", robot_.depth->intrinsics, *log_.depth);
    check_speeds();
    check_joints();
    return std::move(result_);
  }

 private:
  void contradicts(const std::string& what) { result_.contradictions.push_back(what); }
  void agrees(const std::string& what) { result_.agreements.push_back(what); }

  /// Of the described sensors after the first of their kind.
  std::set<std::string> further_channels() const {
    std::set<std::string> described;
    for (const NamedLaser& laser : robot_.further_lasers)
      described.insert(sensor_channel(channel::kScan, laser.name));
    for (const NamedCameras& each : robot_.further_cameras) {
      if (each.camera) described.insert(sensor_channel(channel::kCamera, each.name));
      if (each.depth) described.insert(sensor_channel(channel::kDepth, each.name));
    }
    return described;
  }

  void check_presence() {
    const auto compare = [&](const std::string& key, const std::string& channel, bool described, bool seen) {
      if (seen && !described)
        contradicts(key + ": the log has messages on " + channel +
                    ", but nothing describes the sensor; add '" + key + "'");
      if (described && !seen) contradicts(key + ": is described, but the log has no messages on " + channel);
      if (described && seen) agrees(key + " has messages on " + channel);
    };
    compare("laser", "SCAN", robot_.laser.has_value(), log_.laser.has_value());
    compare("camera", "CAMERA", robot_.camera.has_value(), log_.camera.has_value());
    compare("depth", "DEPTH", robot_.depth.has_value(), log_.depth.has_value());
    compare("imu", "IMU", robot_.imu.has_value(), log_.imu);
    const std::set<std::string> described = further_channels();
    std::set<std::string> all = described;
    all.insert(log_.further.begin(), log_.further.end());
    for (const std::string& name : all) {
      const bool of_laser = parse_sensor_channel(name).canonical == channel::kScan;
      compare(of_laser ? "lasers" : "cameras", name, described.contains(name), log_.further.contains(name));
    }
  }

  void check_clocks() {
    bool advance = true;
    const auto check_rate = [&](const std::string& channel, double rate) {
      constexpr double kFactor = 2;
      if (rate > 1 / kFactor && rate < kFactor) return;
      advance = false;
      contradicts(channel + ": stamps advance by " + number(rate) +
                  " s in a second of the log; utime is the instant of the measurement in microseconds (or "
                  "was the log recorded from a replay at another speed?)");
    };
    if (log_.laser) check_rate(channel::kScan, log_.laser->stamp_rate);
    if (log_.odometry) check_rate(channel::kOdometry, log_.odometry->stamp_rate);
    for (const auto& [channel, laser] : log_.further_lasers) check_rate(channel, laser.stamp_rate);
    if (!advance || !log_.odometry_lag) return;
    constexpr double kApart = 1;  // s
    const double lag = *log_.odometry_lag - robot_.odometry.time_offset;
    if (std::abs(lag) > kApart)
      contradicts("SCAN and ODOMETRY: stamps of messages that arrive together are " + number(std::abs(lag)) +
                  " s apart; all sensors need one clock");
    else
      agrees("SCAN and ODOMETRY have one clock, within " + number(kApart) +
             " s; calibrate measures the rest");
  }

  void check_form(const LaserDescription& laser, const LaserSurvey& seen) {
    if (seen.odd_scans > 0)
      contradicts("laser: " + std::to_string(seen.odd_scans) +
                  " scans have another number of beams, or other angles, than most; the driver must send all "
                  "scans alike");
    if (laser.beams == 0) return;
    if (seen.own_angles) return agrees("laser angles: each scan has its own");
    if (static_cast<std::size_t>(laser.beams) != seen.beams)
      contradicts("laser beams: " + std::to_string(laser.beams) + ", but scans have " +
                  std::to_string(seen.beams));
    if (std::abs(laser.angle_increment - double{seen.angle_increment}) * static_cast<double>(seen.beams) >
            0.02 ||
        std::abs(std::remainder(laser.angle_min - double{seen.angle_min}, 6.283185307)) > 0.02) {
      contradicts("laser angle_min, angle_increment: " + number(laser.angle_min) + " and " +
                  number(laser.angle_increment) + " rad, but scans have " + number(double{seen.angle_min}) +
                  " and " + number(double{seen.angle_increment}) + " rad");
    } else {
      agrees("laser angles");
    }
  }

  void check_times(const LaserDescription& laser, const LaserSurvey& seen) {
    if (seen.backward_stamps > 0)
      contradicts("SCAN: " + std::to_string(seen.backward_stamps) +
                  " stamps go backwards; the sensor's clock jumps");
    if (!(seen.period > 0)) return;
    if (laser.scan_period > 0 && std::abs(laser.scan_period - seen.period) > kPeriodError * seen.period)
      contradicts("laser scan_period: " + number(laser.scan_period) + " s, but the stamps are " +
                  number(seen.period) + " s apart");
    else if (laser.scan_period > 0)
      agrees("laser scan_period");
    const double sweep =
        std::abs((laser.beam_time(seen.beams - 1, seen.beams) - laser.beam_time(0, seen.beams)).seconds());
    if (sweep > (1 + kPeriodError) * seen.period)
      contradicts("laser beam_interval: a scan would take " + number(sweep) + " s, but one comes every " +
                  number(seen.period) + " s");
  }

  void check_beam_order(const std::string& channel, const LaserDescription& laser, const LaserSurvey& seen) {
    const pose::BeamOrder order = pose::beam_order_of(seen.scans, laser);
    if (order.differs())
      contradicts(channel + " beam_interval: " + number(laser.beam_interval) + " s, but " + order.advice());
    if (order.verdict() == pose::BeamOrder::Verdict::as_described)
      agrees(channel + (laser.beam_interval == 0 ? " without beam_interval" : " beam_interval, by its sign"));
  }

  void check_stamp_beam(const std::string& channel, const LaserDescription& laser, const LaserSurvey& seen) {
    if (seen.own_angles) return;
    if (const auto early = early_arrival(laser, seen.beams, seen.arrival))
      contradicts(channel + " " + stamp_beam_advice(*early));
  }

  void check_ranges(const LaserDescription& laser, const LaserSurvey& seen) {
    using Sentinel = RangeConvention::Sentinel;
    const RangeConvention& ranges = laser.convention;
    if (seen.repeated && ranges.classify(*seen.repeated) == BeamKind::hit)
      contradicts("laser no_return: " + percent(seen.repeated_fraction) + " of the ranges are exactly " +
                  number(double{*seen.repeated}) +
                  " m, which would be read as walls; set no_return to it, or range_max below it");
    if (seen.max_range >= ranges.range_max)
      contradicts("laser range_max: " + length_text(double{ranges.range_max}) + ", but ranges up to " +
                  length_text(double{seen.max_range}) + " occur; they are read as no return");
    if (seen.min_range < ranges.range_min)
      contradicts("laser range_min: " + length_text(double{ranges.range_min}) + ", but ranges down to " +
                  length_text(double{seen.min_range}) + " occur");
    if (seen.nan > kRare && ranges.no_return != Sentinel::nan && ranges.too_close != Sentinel::nan)
      contradicts("laser no_return: " + percent(seen.nan) +
                  " of the ranges are NaN, which means neither 'no return' nor 'too close'");
    if (seen.infinite > kRare && ranges.no_return != Sentinel::infinity)
      contradicts("laser no_return: " + percent(seen.infinite) +
                  " of the ranges are infinite; set no_return: infinity");
    if (seen.zero > kRare && ranges.classify(0) == BeamKind::hit)
      contradicts("laser too_close: " + percent(seen.zero) + " of the ranges are 0");
  }

  /// Returns from inside the outline: the laser is elsewhere, or the outline is too large, or it sees the
  /// robot.
  void check_self(const LaserDescription& laser, const LaserSurvey& seen) {
    std::vector<std::size_t> counts(seen.beams);
    for (const Scan& scan : seen.scans) {
      for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
        if (laser.convention.classify(scan.ranges[i]) != BeamKind::hit) continue;
        const double angle = scan.angle(i);
        const double range = double{scan.ranges[i]};
        const Eigen::Vector3d point =
            laser.T_base_laser * Eigen::Vector3d(range * std::cos(angle), range * std::sin(angle), 0);
        counts[i] += inside(robot_.footprint, point.head<2>());
      }
    }
    const auto often = static_cast<std::size_t>(kSelf * static_cast<double>(seen.scans.size()));
    const auto beams =
        std::count_if(counts.begin(), counts.end(), [&](std::size_t n) { return n > 0 && n >= often; });
    if (beams > 0)
      contradicts("laser pose, footprint: " + std::to_string(beams) +
                  " beams end inside the robot's outline in most scans; the laser's pose or the outline is "
                  "wrong, or the laser sees the robot itself: mask those beams in the driver");
    else
      agrees("no beam ends inside the outline in most scans");
  }

  void check_turn(const LaserDescription& laser, const LaserSurvey& seen) {
    if (!log_.odometry) return;
    const int agreement = turn_agreement(seen, *log_.odometry, laser.T_base_laser);
    const bool upside_down = laser.T_base_laser.rotation()(2, 2) < 0;
    if (agreement < 0)
      contradicts(std::string("laser pose, angle_increment, or odometry: scans turn in the opposite "
                              "direction to odometry; the "
                              "beams are in reverse order, ") +
                  (upside_down ? "the laser is not upside down as its pose is (roll, pitch)"
                               : "the laser is upside down and its pose is not (roll: 180 deg)") +
                  ", or odometry's yaw has the wrong sign");
    if (agreement > 0) agrees("scans turn as odometry does");
  }

  void check_size(const char* key, const CameraIntrinsics& described, const ImageSurvey& seen) {
    if (described.width == seen.width && described.height == seen.height)
      return agrees(std::string(key) + " size");
    contradicts(std::string(key) + " width, height: " + std::to_string(described.width) + " x " +
                std::to_string(described.height) + ", but images have " + std::to_string(seen.width) + " x " +
                std::to_string(seen.height) + "; scale fx, fy, cx and cy with them");
  }

  void check_speeds() {
    if (!log_.odometry) return;
    if (log_.odometry->speed > 1.1 * robot_.limits.speed)
      contradicts("limits speed: " + number(robot_.limits.speed) + " m/s, but odometry shows " +
                  number(log_.odometry->speed) + " m/s");
    if (log_.odometry->yaw_rate > 1.1 * robot_.limits.yaw_rate)
      contradicts("limits yaw_rate: " + number(robot_.limits.yaw_rate) + " rad/s, but odometry shows " +
                  number(log_.odometry->yaw_rate) + " rad/s");
  }

  void check_joints() {
    const auto check = [&](const char* key, const std::vector<HeadJoint>& head) {
      for (const HeadJoint& joint : head) {
        if (std::find(log_.joints.begin(), log_.joints.end(), joint.joint) == log_.joints.end())
          contradicts(std::string(key) + " head: joint '" + joint.joint + "' is never on JOINT_STATE");
      }
    };
    if (robot_.camera) check("camera", robot_.camera->head);
    if (robot_.depth) check("depth", robot_.depth->head);
    if (robot_.line_laser) check("line_laser", robot_.line_laser->head);
  }

  const RobotDescription& robot_;
  const LogSurvey& log_;
  DescriptionCheck result_;
};

}  // namespace

DescriptionCheck check_description(const RobotDescription& robot, const LogSurvey& log) {
  return Checker(robot, log).run();
}

}  // namespace parhelion::tools

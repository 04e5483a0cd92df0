#include "tools/calibration/calibration_log.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/pose/calibration/recorded_sweeps.hpp"
#include "fusion/pose/matching/beam_order.hpp"
#include "tools/calibration/calibration_failure.hpp"
#include "tools/calibration/calibration_verdict.hpp"

namespace parhelion::tools {
namespace {

constexpr double kWindow = 2;  ///< s, over which odometry is checked

CalibrationProgress share(const CalibrationProgress& progress, double from, double to) {
  if (!progress) return {};
  return [&progress, from, to](double done, double total) {
    progress(from + (to - from) * done / std::max(total, 1.0), 100);
  };
}

Error in_file(const CalibrationOptions& options, const Error& error, const CalibrationReport& report) {
  std::string message = options.input.string() + ", " + options.scan_channel + " and " +
                        options.odometry_channel + ": " + error.message;
  for (const std::string& finding : report.findings) message += "\n  " + finding;
  return {message};
}

Status check_on(const RecordedDrive& validation, const CalibrationOptions& options, CalibrationReport& report,
                const CalibrationProgress& progress) {
  const auto other = track_drive(validation, report.after, report.deskew, options, progress);
  if (!other) return other.error();
  const pose::MotionParameters old = pose::motion_parameters(report.before);
  report.check_before = pose::check_motion(other->motion, old, kWindow);
  report.check_after = pose::check_motion(other->motion, report.motion.parameters, kWindow);
  report.path_before = pose::reckoned_path(other->motion, old);
  report.path_after = pose::reckoned_path(other->motion, report.motion.parameters);
  report.map = other->map;
  add_faults(*other, report.first_scan, report);
  return {};
}

/// Walls do not need motion: a laser is learned where they suffice, and keeps its preset elsewhere.
void learn_noise(const RecordedDrive& drive, CalibrationReport& report) {
  std::vector<Scan> scans;
  for (const RecordedDrive::Event& event : drive.events) {
    if (event.kind == RecordedDrive::Event::Kind::scan) scans.push_back(drive.scans[event.index]);
  }
  auto learned = scan::learn_laser(scans, *report.after.laser);
  if (!learned) {
    report.laser_note = learned.error().message;
    return;
  }
  report.laser = std::move(*learned);
  report.after.laser = scan::with_learned(*report.after.laser, *report.laser);
}

struct Round {
  TrackedDrive drive;
  pose::MotionCalibration motion;
};

/// SLAM over the drive as `robot` describes it, and what that shows of the description from before.
Result<Round> calibrated(const RecordedDrive& drive, const RobotDescription& robot, Deskew deskew,
                         const CalibrationOptions& options, const CalibrationReport& report,
                         const CalibrationProgress& progress) {
  auto tracked = track_drive(drive, robot, deskew, options, progress);
  if (!tracked) return tracked.error();
  auto motion = pose::calibrate_motion(tracked->motion, pose::motion_parameters(report.before));
  if (!motion)
    return why_nothing_is_shown(motion.error(), drive, *tracked, *robot.laser, options, report.first_scan);
  return Round{std::move(*tracked), std::move(*motion)};
}

/// rad/s, RMS of the turning between the scans, and s between them.
struct Turning {
  double rate = 0, step = 0;
};

Turning turning(const std::vector<pose::LaserPose>& poses) {
  const double whole = (poses.back().stamp - poses.front().stamp).seconds();
  double squares = 0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    squares += std::pow(wrap_angle(poses[i].T_map_laser.yaw - poses[i - 1].T_map_laser.yaw), 2);
  const auto count = static_cast<double>(poses.size());
  return {std::sqrt(squares / count) / (whole / count), whole / count};
}

/// s, 1 sigma. `other`: the time offset by poses from scans that were corrected for their sweep in the other
/// way.
double sweep_sigma(const RecordedDrive& drive, const Round& round, double other,
                   const CalibrationReport& report) {
  const pose::RecordedSweeps sweeps(drive.odometry, report.after.odometry, *report.before.laser,
                                    drive.scans.front().ranges.size());
  if (report.deskew == Deskew::live) {
    // At worst a scan stands for any instant of its sweep.
    const double apart = round.motion.parameters.odometry.time_offset - other;
    return std::min(sweeps.sweep() / std::sqrt(12.0), std::hypot(sweeps.left_over(), apart));
  }
  const Turning robot = turning(round.drive.motion.laser);
  return sweeps.offset_sigma(round.motion.noise, robot.step, robot.rate);
}

/// What the way in which the scans were made adds to the fit's own confidence.
void add_systematic_errors(const RecordedDrive& drive, const CalibrationOptions& options,
                           CalibrationReport& report) {
  report.motion.add_offset_error(report.sweep_sigma);
  const pose::RecordedSweeps sweeps(drive.odometry, report.after.odometry, *report.before.laser,
                                    drive.scans.front().ranges.size());
  // Rough scans that last 167 ms seem to jitter by 3 to 5 ms.
  constexpr double kOfTheSweep = 0.03;
  report.motion.add_jitter_error(kOfTheSweep * sweeps.sweep());
  double width = options.track_width;
  if (width == 0) {
    for (const Eigen::Vector2d& corner : report.before.footprint)
      width = std::max(width, 2 * std::abs(corner.y()));
  }
  report.motion.add_turning_point_error(width);
}

RobotDescription with_reversed_beams(RobotDescription robot) {
  robot.laser->beam_interval = -robot.laser->beam_interval;
  return robot;
}

bool has_as_many_steps(const pose::MotionCalibration& now, const pose::MotionCalibration& then) {
  return static_cast<double>(now.steps) >= 0.9 * static_cast<double>(then.steps);
}

/// Whether the same drive gives far smaller errors, of as many steps of odometry.
bool is_far_better(const pose::MotionCalibration& now, const pose::MotionCalibration& then) {
  // Of the product of two variances. Right descriptions of two recorded drives with slow sweeps: 1.4 and 6.5;
  // a TurtleBot 4 whose driver reverses its beams: 0.10.
  constexpr double kFarBetter = 0.4;
  return now.noise.misfit() < kFarBetter * then.noise.misfit() && has_as_many_steps(now, then);
}

/// The first round, with the beams of a message in the order that the description gives, or in reverse order
/// where scans that are corrected for their sweep so agree far better with odometry, or at all.
Result<Round> first_round(const RecordedDrive& drive, const CalibrationOptions& options,
                          CalibrationReport& report, const CalibrationProgress& progress) {
  constexpr double kSlow = 0.03;  // s: a shorter sweep shows no order
  auto round = calibrated(drive, report.before, report.deskew, options, report, share(progress, 5, 15));
  const auto beams = static_cast<double>(drive.scans.front().ranges.size());
  if (drive.scans.front().is_timed() || std::abs(report.before.laser->beam_interval) * beams < kSlow)
    return round;
  auto other = calibrated(drive, with_reversed_beams(report.before), report.deskew, options, report,
                          share(progress, 15, 25));
  if (!other || (round && !is_far_better(other->motion, round->motion))) return round;
  report.reversed_beams = true;
  return other;
}

/// Three rounds, as poses by SLAM lean towards the odometry and the mounting that they start from. After the
/// first, scans are corrected for their sweep with what it found of odometry; unless that brings scans and
/// odometry apart, as where odometry is rough: its noise would then be taken for the motion of the laser.
Result<std::vector<pose::LaserPose>> calibrate_in_rounds(const RecordedDrive& drive,
                                                         const CalibrationOptions& options,
                                                         CalibrationReport& report,
                                                         const CalibrationProgress& progress) {
  auto best = first_round(drive, options, report, progress);
  if (!best) return best.error();
  const RobotDescription robot = report.reversed_beams ? with_reversed_beams(report.before) : report.before;
  report.after = pose::with_motion_parameters(robot, best->motion.parameters);
  std::optional<Round> refused;
  for (const bool second : {true, false}) {
    const Deskew deskew = second ? Deskew::recorded : report.deskew;
    auto next = calibrated(drive, report.after, deskew, options, report,
                           second ? share(progress, 25, 45) : share(progress, 45, 65));
    if (!next) return next.error();
    if (second && next->motion.noise.misfit() > best->motion.noise.misfit()) {
      refused = std::move(*next);
      continue;
    }
    report.deskew = deskew;
    best = std::move(*next);
    // Live, the first round may owe its small errors to odometry that came at the instant of each scan.
    if (refused && refused->motion.noise.misfit() < best->motion.noise.misfit() &&
        has_as_many_steps(refused->motion, best->motion)) {
      report.deskew = Deskew::recorded;
      std::swap(*best, *refused);
    }
    report.after = pose::with_motion_parameters(robot, best->motion.parameters);
  }
  const double refused_offset = refused ? refused->motion.parameters.odometry.time_offset : 0;  // s
  report.sweep_sigma = sweep_sigma(drive, *best, refused_offset, report);
  report.check_fitted = pose::check_motion(best->drive.motion, best->motion.parameters, kWindow);
  add_faults(best->drive, report.first_scan, report);
  report.motion = std::move(best->motion);
  add_systematic_errors(drive, options, report);
  return std::move(best->drive.motion.laser);
}

/// A stamp that is of another beam than described moves all beams of a scan, and not odometry alone.
void warn_of_stamps(const ReadDrive& read, CalibrationReport& report) {
  const Scan& first = read.drive.scans.front();
  if (!first.angles.empty() || !first.times.empty()) return;
  const ScanArrival arrival = scan_arrival(read.scan_arrivals, read.odometry_arrivals);
  if (const auto early = early_arrival(*report.before.laser, first.ranges.size(), arrival))
    report.warnings.push_back("laser " + stamp_beam_advice(*early));
}

}  // namespace

Result<CalibrationReport> calibrate_log(const CalibrationOptions& options,
                                        const CalibrationProgress& progress) {
  CalibrationReport report;
  auto read = read_drive(options, share(progress, 0, 5));
  if (!read) return read.error();
  report.refused = read->refused;
  report.findings = std::move(read->findings);
  report.after = report.before = read->robot;
  report.odometry_samples = read->drive.odometry.size();
  report.first_scan = read->drive.scans.front().stamp;
  const DriveParts parts = split_drive(read->drive, options);
  report.scans = parts.calibrating.scan_events();
  report.validation_scans = parts.validation.scan_events();
  const auto laser = calibrate_in_rounds(parts.calibrating, options, report, progress);
  if (!laser) return in_file(options, laser.error(), report);
  report.imu = calibrate_imu(read->drive, report.before, *laser);
  report.camera = calibrate_camera(options, report.before, read->images, *laser, share(progress, 65, 75));
  for (TurnSensor* sensor : {&report.imu, &report.camera}) add_offset_error(report.sweep_sigma, *sensor);
  report.after = with_time_offsets(report.after, report.imu, report.camera);
  report.level = calibrate_level(options, parts.calibrating, report.after, read->depth_images, *laser,
                                 share(progress, 75, 85));
  if (report.level.found) {
    keep_above_floor(report.validation_scans > 0 ? parts.validation : parts.calibrating, report.after,
                     *report.level.found);
    report.after = with_level(report.after, *report.level.found);
  }
  learn_noise(parts.calibrating, report);
  if (report.validation_scans > 0) {
    if (const Status checked = check_on(parts.validation, options, report, share(progress, 85, 100));
        !checked)
      return in_file(options, checked.error(), report);
  }
  const auto names_it = [](const std::string& refusal) {
    return refusal.find("repeats one scan") != std::string::npos;
  };
  if (std::none_of(report.refusals.begin(), report.refusals.end(), names_it))
    add_repeated_scans(read->drive, report);
  judge(options, report);
  warn_of_stamps(*read, report);
  if (const auto order = pose::beam_order_of(parts.calibrating.scans, *report.after.laser); order.differs())
    report.warnings.push_back(order.advice() + ", and calibrate again");
  return report;
}

}  // namespace parhelion::tools

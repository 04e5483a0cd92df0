#include "tools/calibration_log.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/pose/calibration/recorded_sweeps.hpp"

namespace parhelion::tools {
namespace {

constexpr double kWindow = 2;  ///< s, over which odometry is checked

CalibrationProgress share(const CalibrationProgress& progress, double from, double to) {
  if (!progress) return {};
  return [&progress, from, to](double done, double total) {
    progress(from + (to - from) * done / std::max(total, 1.0), 100);
  };
}

Error in_file(const CalibrationOptions& options, const Error& error) {
  return {options.input.string() + ", " + options.scan_channel + " and " + options.odometry_channel + ": " +
          error.message};
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
  std::vector<pose::LaserPose> laser;
  pose::MotionCalibration motion;
};

/// SLAM over the drive as `robot` describes it, and what that shows of the description from before.
Result<Round> calibrated(const RecordedDrive& drive, const RobotDescription& robot, Deskew deskew,
                         const CalibrationOptions& options, const CalibrationReport& report,
                         const CalibrationProgress& progress) {
  auto tracked = track_drive(drive, robot, deskew, options, progress);
  if (!tracked) return tracked.error();
  auto motion = pose::calibrate_motion(tracked->motion, pose::motion_parameters(report.before));
  if (!motion) return motion.error();
  return Round{std::move(tracked->motion.laser), std::move(*motion)};
}

/// s, 1 sigma. A scan that is not corrected for its sweep by what is known of odometry stands for any instant
/// of it.
double sweep_sigma(const RecordedDrive& drive, const Round& round, const CalibrationReport& report) {
  const LaserDescription& laser = *report.before.laser;
  const std::size_t beams = drive.scans.front().ranges.size();
  if (beams == 0) return 0;
  if (report.deskew == Deskew::live)
    return (laser.beam_time(beams - 1, beams) - laser.beam_time(0, beams)).seconds() / std::sqrt(12.0);
  const pose::RecordedSweeps sweeps(drive.odometry, report.after.odometry, laser, beams);
  const double whole = (round.laser.back().stamp - round.laser.front().stamp).seconds();
  return sweeps.offset_sigma(round.motion.noise, whole / static_cast<double>(round.laser.size()));
}

/// Three rounds, as poses by SLAM lean towards the odometry and the mounting that they start from. After the
/// first, scans are corrected for their sweep with what it found of odometry; unless that brings scans and
/// odometry apart, as where odometry is rough: its noise would then be taken for the motion of the laser.
Result<std::vector<pose::LaserPose>> calibrate_in_rounds(const RecordedDrive& drive,
                                                         const CalibrationOptions& options,
                                                         CalibrationReport& report,
                                                         const CalibrationProgress& progress) {
  constexpr double kFractions[] = {5, 25, 45, 65};
  constexpr int kRounds = 3;
  std::optional<Round> best;
  for (int round = 0; round < kRounds; ++round) {
    const Deskew deskew = round == 1 ? Deskew::recorded : report.deskew;
    auto next = calibrated(drive, report.after, deskew, options, report,
                           share(progress, kFractions[round], kFractions[round + 1]));
    if (!next) return next.error();
    if (round == 1 && next->motion.noise.misfit() > best->motion.noise.misfit()) continue;
    report.deskew = deskew;
    best = std::move(*next);
    report.after = pose::with_motion_parameters(report.before, best->motion.parameters);
  }
  report.sweep_sigma = sweep_sigma(drive, *best, report);
  report.motion = std::move(best->motion);
  report.motion.add_offset_error(report.sweep_sigma);
  return std::move(best->laser);
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
  const DriveParts parts = split_drive(read->drive, options);
  report.scans = parts.calibrating.scan_events();
  report.validation_scans = parts.validation.scan_events();
  const auto laser = calibrate_in_rounds(parts.calibrating, options, report, progress);
  if (!laser) return in_file(options, laser.error());
  report.imu = calibrate_imu(read->drive, report.before, *laser);
  report.camera = calibrate_camera(options, report.before, read->images, *laser, share(progress, 65, 80));
  for (TurnSensor* sensor : {&report.imu, &report.camera}) add_offset_error(report.sweep_sigma, *sensor);
  report.after = with_time_offsets(report.after, report.imu, report.camera);
  learn_noise(parts.calibrating, report);
  if (report.validation_scans == 0) return report;
  if (const Status checked = check_on(parts.validation, options, report, share(progress, 80, 100)); !checked)
    return in_file(options, checked.error());
  return report;
}

}  // namespace parhelion::tools

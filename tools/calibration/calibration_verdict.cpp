#include "tools/calibration/calibration_verdict.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <utility>

#include "protocols/angle_units.hpp"
#include "tools/slam/slam_report.hpp"

namespace parhelion::tools {
namespace {

/// Of a part of the drive: a slip of the wheels now and then has little weight.
constexpr double kAllowedFraction = 0.1;

/// What `calibrate` finds is no fault, unless it changes during the drive.
std::string described(pose::OdometryFinding finding, SensorTime first_scan) {
  for (const auto& [fault, text] :
       {std::pair{
            pose::OdometryFault::scale,
            "odometry's scale changes during the drive: check encoders and gears, and whether wheels slip"},
        std::pair{pose::OdometryFault::delayed,
                  "odometry's time offset changes during the drive: check its clock and its driver"}}) {
    const std::string advice = pose::advice(fault);
    if (finding.text.starts_with(advice)) finding.text.replace(0, advice.size(), text);
  }
  return dated(finding, first_scan);
}

bool faults_decide(const TrackedDrive& part) {
  constexpr double kShort = 3;  // s: one slip until it is over for certain, also in a short part
  const double whole = (part.last_scan - part.first_scan).seconds();
  if (!(whole > 0)) return true;
  double faulty = 0;
  bool over = true;
  for (const pose::OdometryFinding& finding : part.findings) {
    over = over && finding.until.has_value();
    faulty += (finding.until.value_or(part.last_scan) - finding.since).seconds();
  }
  return faulty > (over ? std::max(kShort, kAllowedFraction * whole) : kAllowedFraction * whole);
}

/// Scans and odometry cannot tell a laser that looks backward from odometry with the wrong sign. But robots
/// drive forward more than backward.
void judge_direction(CalibrationReport& report) {
  const double turned = std::abs(wrap_angle(report.motion.parameters.T_base_laser.yaw -
                                            pose::motion_parameters(report.before).T_base_laser.yaw));
  if (turned < std::numbers::pi / 4) return;
  const double forward = report.motion.forward, backward = report.motion.backward;
  char text[400];
  if (turned > 3 * std::numbers::pi / 4 && backward > 2 * forward) {
    std::snprintf(text, sizeof text,
                  "odometry drives %.1f m backward and %.1f m forward, where the laser as described looks "
                  "forward: change the sign of odometry's translation; if the robot did drive backward, turn "
                  "the laser's yaw by 180 deg in the description and calibrate again",
                  backward, forward);
    report.refusals.emplace_back(text);
    return;
  }
  std::snprintf(text, sizeof text,
                "the laser's yaw changes by %.0f deg: if it is not mounted so, odometry has a wrong sign or "
                "its axes are swapped",
                kDegreesPerRadian * turned);
  report.warnings.emplace_back(text);
}

/// Jitter beyond the period of odometry disorders its samples.
void judge_order(CalibrationReport& report) {
  const std::size_t out = report.motion.left_out, all = report.odometry_samples;
  if (50 * out <= all) return;
  report.warnings.push_back(std::to_string(out) + " of " + std::to_string(all) +
                            " samples of odometry have stamps that are not later than the one before and are "
                            "left out: the jitter of its stamps is larger than what is stated here");
}

/// What the validation part does not show to be better, and is far from what was measured by hand, is rather
/// this drive's error than the mounting's.
void judge_mounting(CalibrationReport& report) {
  constexpr double kFar = 0.03, kFarYaw = 3;  // m, degrees: beyond what a tape and an eye get wrong
  const Pose2 before = pose::motion_parameters(report.before).T_base_laser,
              after = pose::motion_parameters(report.after).T_base_laser;
  const double moved = (after.position() - before.position()).norm(),
               turned = kDegreesPerRadian * std::abs(wrap_angle(after.yaw - before.yaw));
  if (moved < kFar && turned < kFarYaw) return;
  char text[300];
  std::snprintf(
      text, sizeof text,
      "the laser's place changes by %.0f mm and %.1f deg, and no validation shows that this is better: "
      "measure it on the robot, or drive longer and with turns both ways",
      1000 * moved, turned);
  report.warnings.emplace_back(text);
}

void judge_beam_order(CalibrationReport& report) {
  report.warnings.emplace_back(
      report.after.laser->beam_interval < 0
          ? "the last beam of a message is measured first, as with a driver that sorts the beams of a laser "
            "that "
            "turns clockwise: beam_interval is negative now"
          : "the first beam of a message is measured first: beam_interval is positive now");
}

/// Bit by bit.
bool is_same(const Scan& a, const Scan& b) {
  return a.ranges.size() == b.ranges.size() &&
         std::memcmp(a.ranges.data(), b.ranges.data(), a.ranges.size() * sizeof(float)) == 0;
}

}  // namespace

const char* to_string(CalibrationVerdict verdict) {
  constexpr const char* kNames[] = {"better", "as_good", "not_checked", "refused"};
  return kNames[static_cast<std::size_t>(verdict)];
}

void add_faults(const TrackedDrive& part, SensorTime first_scan, CalibrationReport& report) {
  auto& where = faults_decide(part) ? report.refusals : report.warnings;
  const auto known = report.faults;
  for (const pose::OdometryFinding& finding : part.findings) {
    report.faults.push_back(finding);
    // What lasts from the other part on needs no second line.
    const bool again = std::any_of(known.begin(), known.end(), [&finding](const auto& other) {
      return other.fault == finding.fault && !other.until;
    });
    if (!again || report.refusals.empty()) where.push_back(described(finding, first_scan));
  }
}

std::string known_faults(const TrackedDrive& part, SensorTime first_scan) {
  std::string text;
  for (const pose::OdometryFinding& finding : part.findings) text += "; " + described(finding, first_scan);
  return text;
}

void add_repeated_scans(const RecordedDrive& part, CalibrationReport& report) {
  constexpr double kMoved = 0.005, kTurned = 0.005;  // m, rad
  using Kind = RecordedDrive::Event::Kind;
  std::size_t in_motion = 0, repeated = 0;
  const Scan* last = nullptr;
  Pose2 odometry, at_last;
  for (const RecordedDrive::Event& event : part.events) {
    if (event.kind == Kind::odometry) odometry = planar(part.odometry[event.index].T_odom_base);
    if (event.kind != Kind::scan) continue;
    const Scan& scan = part.scans[event.index];
    const Pose2 step = at_last.inverse() * odometry;
    if (last && scan.stamp != last->stamp &&
        (step.position().norm() > kMoved || std::abs(step.yaw) > kTurned)) {
      ++in_motion;
      repeated += is_same(scan, *last) ? 1 : 0;
    }
    last = &scan;
    at_last = odometry;
  }
  if (static_cast<double>(repeated) <= kAllowedFraction * static_cast<double>(in_motion)) return;
  report.refusals.push_back("the laser repeats one scan while odometry moves, " + std::to_string(repeated) +
                            " of " + std::to_string(in_motion) + " scans: check its driver");
}

void judge(const CalibrationOptions& options, CalibrationReport& report) {
  judge_direction(report);
  if (report.reversed_beams) judge_beam_order(report);
  if (report.refusals.empty()) judge_order(report);
  const bool checked = report.check_after.windows > 0;
  if (const std::string why =
          pose::unexplained_error(report.check_fitted, checked ? report.check_after : report.check_fitted);
      !why.empty())
    report.refusals.push_back(why);
  pose::MotionChange change = pose::change_between(report.check_before, report.check_after);
  // An error as large as where the result was fitted is the drive's noise.
  constexpr double kAsFitted = 1.2;
  if (change == pose::MotionChange::worse &&
      report.check_after.combined_rms() < kAsFitted * report.check_fitted.combined_rms())
    change = pose::MotionChange::as_good;
  if (report.refusals.empty() && change == pose::MotionChange::worse)
    report.refusals.emplace_back(
        "odometry agrees worse with the scans of the validation part than before: drive again, straight and "
        "with turns both ways");
  if (options.validation_fraction > 0 && !checked && report.refusals.empty())
    report.refusals.emplace_back(
        "the validation part is too short to check it: drive for longer, or omit the check with "
        "--validation 0");
  if (!report.refusals.empty())
    report.verdict = CalibrationVerdict::refused;
  else if (!checked)
    report.verdict = CalibrationVerdict::not_checked;
  else
    report.verdict =
        change == pose::MotionChange::better ? CalibrationVerdict::better : CalibrationVerdict::as_good;
  if (report.verdict == CalibrationVerdict::as_good || report.verdict == CalibrationVerdict::not_checked)
    judge_mounting(report);
}

}  // namespace parhelion::tools

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <tuple>

#include "fusion/semantic/pictures/plan_picture.hpp"
#include "protocols/angle_units.hpp"
#include "tools/calibration/calibration_log.hpp"
#include "tools/slam/slam_report.hpp"

namespace parhelion::tools {
namespace {

using P = pose::MotionParameter;
using pose::Measured;

/// How a quantity is printed: a factor to the unit, and its name.
struct Unit {
  P parameter;
  const char* key;
  double factor;
  const char* unit;
  int digits;
};
constexpr Unit kUnits[] = {{P::translation_scale, "translation_scale", 1, "", 4},
                           {P::rotation_scale, "rotation_scale", 1, "", 4},
                           {P::curvature, "curvature_deg_per_m", kDegreesPerRadian, "deg/m", 3},
                           {P::laser_x, "laser_x_mm", 1e3, "mm", 1},
                           {P::laser_y, "laser_y_mm", 1e3, "mm", 1},
                           {P::laser_yaw, "laser_yaw_deg", kDegreesPerRadian, "deg", 3},
                           {P::time_offset, "time_offset_ms", 1e3, "ms", 1},
                           {P::reference_offset, "reference_offset_ms", 1e3, "ms", 1}};
// Of other sensors; the parameter does not count.
constexpr Unit kOffset{P::time_offset, "time_offset_ms", 1e3, "ms", 1};
constexpr Unit kScale{P::rotation_scale, "yaw_scale", 1, "", 4};
constexpr Unit kHeight{P::laser_x, "laser_height_mm", 1e3, "mm", 0};
constexpr Unit kTilt{P::laser_yaw, "", kDegreesPerRadian, "deg", 2};
constexpr Unit kBias{P::time_offset, "yaw_bias_deg_per_s", kDegreesPerRadian, "deg/s", 3};

std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));
std::string format(const char* pattern, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

std::string line(const char* name, double before, const Measured& now, const Unit& unit) {
  if (!now.shown)
    return format("  %-18s %10.*f %-5s kept; not shown by this drive\n", name, unit.digits,
                  before * unit.factor, unit.unit);
  return format("  %-18s %10.*f +- %.*f %-5s (was %.*f)\n", name, unit.digits, now.value * unit.factor,
                unit.digits, now.sigma * unit.factor, unit.unit, unit.digits, before * unit.factor);
}

std::string check_line(const char* name, const pose::MotionCheck& check) {
  return format("  %-7s %6.1f mm, %.3f deg RMS; p95 %.1f mm, %.3f deg\n", name, 1e3 * check.position_rms,
                kDegreesPerRadian * check.yaw_rms, 1e3 * check.position_p95,
                kDegreesPerRadian * check.yaw_p95);
}

/// Time offset, and of an inertial sensor scale and bias.
std::string turn_lines(const TurnSensor& sensor) {
  if (!sensor.found) return sensor.note.empty() ? "" : "  " + sensor.name + ": " + sensor.note + "\n";
  const pose::TurnCalibration& found = *sensor.found;
  std::string text = line((sensor.name + " offset").c_str(), sensor.before, found.time_offset, kOffset);
  if (sensor.has_bias) {
    text += line((sensor.name + " yaw scale").c_str(), 1, found.scale, kScale) +
            line((sensor.name + " yaw bias").c_str(), 0, found.bias, kBias);
  }
  return text + format("    at %zu scans, %zu of them outliers; %.2f deg apart, stamps %.1f ms (1 sigma)\n",
                       found.poses, found.outliers, kDegreesPerRadian * found.heading_sigma,
                       1e3 * found.jitter);
}

/// Offset between the clocks of inertial sensor and odometry.
std::string between_clocks(const CalibrationReport& report) {
  const Measured& odometry = report.motion[P::time_offset];
  if (!report.imu.found || !report.imu.found->time_offset.shown || !odometry.shown) return "";
  const Measured& imu = report.imu.found->time_offset;
  return format("    IMU against odometry: %.1f +- %.1f ms\n", 1e3 * (imu.value - odometry.value),
                1e3 * std::hypot(imu.sigma, odometry.sigma));
}

/// Height and tilt of the laser.
std::string level_lines(const CalibrationReport& report) {
  if (!report.level.found)
    return report.level.note.empty() ? "" : "  laser's height and tilt kept: " + report.level.note + "\n";
  const LaserLevel& level = *report.level.found;
  std::string text =
      line("laser height", report.before.laser->T_base_laser.translation().z(), level.height, kHeight) +
      line("laser pitch more", 0, level.pitch, kTilt) + line("laser roll more", 0, level.roll, kTilt) +
      format("    by %zu beams in %zu depth images, of which %.0f %% agree, and %zu places with edges\n",
             level.beams, level.images, 100 * level.agreeing, level.things);
  for (const auto& [name, found, writes] : {std::tuple{"pitch", level.pitch, level.writes_pitch},
                                            std::tuple{"roll", level.roll, level.writes_roll}}) {
    if (found.shown && !writes)
      text += format("    %s stays as described: not known precisely enough, or not different\n", name);
  }
  if (!level.camera) return text + "    no floor in the depth images\n";
  return text + format(
                    "    according to the floor, the depth camera is %.0f mm higher than described, and "
                    "turned by %.1f "
                    "deg (pitch), %.1f deg (roll)\n",
                    1e3 * level.camera->height, kDegreesPerRadian * level.camera->pitch,
                    kDegreesPerRadian * level.camera->roll);
}

std::string laser_lines(const CalibrationReport& report) {
  if (!report.laser) return "  laser's noise kept: " + report.laser_note + "\n";
  const scan::LearnedLaser& laser = *report.laser;
  std::string text =
      format("  laser, %zu pieces of walls: step %.2f mm (was %.2f), sigma %.1f mm (was %.1f)\n",
             laser.windows, 1e3 * laser.quantization, 1e3 * report.before.laser->quantization,
             1e3 * laser.sigma, 1e3 * report.before.laser->noise_sigma);
  text += "    sigma at 1, 2, 4, 8, 16, 32 m:";
  for (const double sigma : laser.noise.sigma) text += format(" %.1f", 1e3 * sigma);
  text += format(" mm; incidence %.1f mm, spread %.2f, correlation %.2f, dropouts %.2f %%\n",
                 1e3 * laser.noise.incidence, laser.noise.spread, laser.noise.correlation,
                 100 * laser.noise.dropout);
  if (laser.intensity_codes.empty()) return text;
  text += "    intensities:";
  for (std::size_t i = 0; i < laser.intensity_codes.size() && i < 8; ++i)
    text +=
        format(" %g (%.1f %%)", double{laser.intensity_codes[i]}, 100 * double{laser.intensity_fractions[i]});
  return text + "\n";
}

std::vector<std::string> advice_of(const CalibrationReport& report) {
  std::vector<std::string> advice = report.motion.advice;
  for (const TurnSensor* sensor : {&report.imu, &report.camera}) {
    if (sensor->found)
      advice.insert(advice.end(), sensor->found->advice.begin(), sensor->found->advice.end());
  }
  if (report.level.found)
    advice.insert(advice.end(), report.level.found->advice.begin(), report.level.found->advice.end());
  return advice;
}

bool is_shown(const CalibrationReport& report, const Unit& unit) {
  return unit.parameter != P::reference_offset || report.motion.references > 0;
}

nlohmann::ordered_json to_json(const Measured& measured, double factor) {
  return {{"value", measured.value * factor}, {"sigma", measured.sigma * factor}, {"shown", measured.shown}};
}

nlohmann::ordered_json to_json(const TurnSensor& sensor) {
  if (!sensor.found) return {{"note", sensor.note}};
  const pose::TurnCalibration& found = *sensor.found;
  nlohmann::ordered_json json{{kOffset.key, to_json(found.time_offset, kOffset.factor)}};
  if (sensor.has_bias) {
    json[kScale.key] = to_json(found.scale, kScale.factor);
    json[kBias.key] = to_json(found.bias, kBias.factor);
  }
  json["scans"] = found.poses;
  json["outliers"] = found.outliers;
  return json;
}

nlohmann::ordered_json to_json(const pose::MotionCheck& check) {
  return {{"windows", check.windows},
          {"position_rms_mm", 1e3 * check.position_rms},
          {"position_p95_mm", 1e3 * check.position_p95},
          {"yaw_rms_deg", kDegreesPerRadian * check.yaw_rms},
          {"yaw_p95_deg", kDegreesPerRadian * check.yaw_p95}};
}

std::string check_lines(const CalibrationReport& report) {
  if (report.check_after.windows == 0) return "";
  return format("odometry against scans over 2 s, %zu windows of the validation part (%zu scans):\n",
                report.check_after.windows, report.validation_scans) +
         check_line("before", report.check_before) + check_line("after", report.check_after);
}

std::string verdict_lines(const CalibrationReport& report) {
  switch (report.verdict) {
    case CalibrationVerdict::better:
      return "the result holds: odometry agrees better with the scans than before\n";
    case CalibrationVerdict::as_good:
      return "the result holds, but is no better than the description before, within the noise of the "
             "drive\n";
    case CalibrationVerdict::not_checked:
      return "no part was kept for validation: not checked\n";
    case CalibrationVerdict::refused:
      break;
  }
  std::string text;
  for (const std::string& refusal : report.refusals) text += "do not use this result: " + refusal + "\n";
  return text;
}

std::vector<Eigen::Vector2d> positions(const std::vector<Pose2>& poses) {
  std::vector<Eigen::Vector2d> points;
  for (const Pose2& pose : poses) points.push_back(pose.position());
  return points;
}

}  // namespace

std::string to_text(const CalibrationReport& report, const CalibrationOptions& options) {
  const pose::MotionCalibration& motion = report.motion;
  std::string text =
      format("%zu scans, %.1f m and %.0f deg driven; %zu steps of odometry, %zu of them outliers (slip)\n",
             report.scans, motion.driven, kDegreesPerRadian * motion.turned, motion.steps, motion.outliers);
  const pose::MotionParameters before = pose::motion_parameters(report.before);
  for (const Unit& unit : kUnits) {
    if (is_shown(report, unit))
      text += line(to_string(unit.parameter), before[unit.parameter], motion[unit.parameter], unit);
  }
  const Measured& jitter = motion.jitter;
  text += jitter.shown
              ? format("  %-18s %10.1f +- %.1f ms\n", "jitter", 1e3 * jitter.value, 1e3 * jitter.sigma)
              : format("  %-18s below %.0f ms\n", "jitter", 1e3 * (jitter.value + 2 * jitter.sigma));
  if (options.track_width > 0) {
    const pose::WheelModel wheels = pose::wheel_model(motion, options.track_width);
    const Unit scale{P::translation_scale, "", 1, "", 4}, width{P::laser_x, "", 1e3, "mm", 1};
    text += line("left wheel", 1, wheels.left_scale, scale) +
            line("right wheel", 1, wheels.right_scale, scale) +
            line("track width", options.track_width, wheels.track_width, width);
  }
  text += turn_lines(report.imu) + between_clocks(report) + turn_lines(report.camera) + level_lines(report) +
          laser_lines(report);
  // A drive with a fault shows nothing, however it is driven.
  if (report.verdict != CalibrationVerdict::refused) {
    for (const std::string& advice : advice_of(report)) text += "  " + advice + "\n";
  }
  for (const std::string& warning : report.warnings) text += "  look at this: " + warning + "\n";
  return text + check_lines(report) + verdict_lines(report);
}

std::string to_json(const CalibrationReport& report, const CalibrationOptions& options) {
  nlohmann::ordered_json json;
  json["scans"] = report.scans;
  json["validation_scans"] = report.validation_scans;
  json["driven_m"] = report.motion.driven;
  json["turned_deg"] = kDegreesPerRadian * report.motion.turned;
  json["steps"] = report.motion.steps;
  json["outliers"] = report.motion.outliers;
  for (const Unit& unit : kUnits) {
    if (is_shown(report, unit)) json[unit.key] = to_json(report.motion[unit.parameter], unit.factor);
  }
  json["jitter_ms"] = to_json(report.motion.jitter, 1e3);
  if (options.track_width > 0) {
    const pose::WheelModel wheels = pose::wheel_model(report.motion, options.track_width);
    json["left_scale"] = to_json(wheels.left_scale, 1);
    json["right_scale"] = to_json(wheels.right_scale, 1);
    json["track_width_mm"] = to_json(wheels.track_width, 1e3);
  }
  if (report.laser) {
    json["laser"] = {
        {"windows", report.laser->windows},       {"quantization_mm", 1e3 * report.laser->quantization},
        {"sigma_mm", 1e3 * report.laser->sigma},  {"correlation", report.laser->noise.correlation},
        {"dropout", report.laser->noise.dropout}, {"intensity_codes", report.laser->intensity_codes}};
  }
  for (const auto& [key, sensor] : {std::pair{"imu", &report.imu}, std::pair{"camera", &report.camera}}) {
    if (sensor->found || !sensor->note.empty()) json[key] = to_json(*sensor);
  }
  if (report.level.found) {
    const LaserLevel& level = *report.level.found;
    json["level"] = {{kHeight.key, to_json(level.height, kHeight.factor)},
                     {"laser_pitch_more_deg", to_json(level.pitch, kTilt.factor)},
                     {"laser_roll_more_deg", to_json(level.roll, kTilt.factor)},
                     {"writes_pitch", level.writes_pitch},
                     {"writes_roll", level.writes_roll},
                     {"beams", level.beams},
                     {"images", level.images},
                     {"agreeing", level.agreeing},
                     {"places", level.things},
                     {"floor", level.camera.has_value()}};
    if (level.camera)
      json["level"]["depth_camera"] = {{"higher_mm", 1e3 * level.camera->height},
                                       {"pitch_more_deg", kDegreesPerRadian * level.camera->pitch},
                                       {"roll_more_deg", kDegreesPerRadian * level.camera->roll}};
  } else if (!report.level.note.empty()) {
    json["level"] = {{"note", report.level.note}};
  }
  json["advice"] = advice_of(report);
  json["reversed_beams"] = report.reversed_beams;
  json["verdict"] = to_string(report.verdict);
  json["holds"] = nullptr;
  if (report.verdict != CalibrationVerdict::not_checked)
    json["holds"] = report.verdict != CalibrationVerdict::refused;
  json["refusals"] = report.refusals;
  json["warnings"] = report.warnings;
  json["odometry_faults"] = faults_json(report.faults, report.first_scan);
  json["validation"] = nullptr;
  if (report.check_after.windows > 0)
    json["validation"] = {{"before", to_json(report.check_before)}, {"after", to_json(report.check_after)}};
  return json.dump(2) + "\n";
}

Status draw_calibration(const CalibrationReport& report, const std::string& path) {
  if (report.path_after.by_laser.empty())
    return Error{path + ": no picture, as no part was kept for validation to check the calibration on"};
  semantic::PlanPicture picture;
  picture.title = "Calibration, checked on the validation part";
  picture.subtitle =
      format("odometry over 2 s: %.1f mm, %.2f deg before; %.1f mm, %.2f deg after (RMS)",
             1e3 * report.check_before.position_rms, kDegreesPerRadian * report.check_before.yaw_rms,
             1e3 * report.check_after.position_rms, kDegreesPerRadian * report.check_after.yaw_rms);
  picture.map = &report.map;
  picture.width = 1000;
  picture.focus = 0.6;  // differences are centimetres
  picture.paths = {{"scan matching", {32, 38, 46}, positions(report.path_after.by_laser), {}},
                   {"odometry before", {207, 34, 46}, positions(report.path_before.by_odometry), {}},
                   {"odometry after", {31, 111, 235}, positions(report.path_after.by_odometry), {}}};
  return semantic::draw_plan(picture, path);
}

}  // namespace parhelion::tools

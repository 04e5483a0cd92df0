#include "tools/robot/new_description.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "fusion/scan/laser_learning.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/robot.hpp"

namespace parhelion::tools {
namespace {

/// Thrown within this file: an answer is wrong, at any depth.
struct Wrong {
  std::string words;
};

std::string format(const char* how, double value) {
  char text[64];
  std::snprintf(text, sizeof text, how, value);
  return text;
}
/// To a tenth of a millimetre, without zeros at the end.
std::string length(double metres) {
  std::string text = format("%.4f", metres);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return (text == "-0" ? "0" : text) + " m";
}
std::string degrees(double radians) { return format("%.6g deg", radians * 180 / std::numbers::pi); }

std::string pose_text(const Eigen::Isometry3d& T, bool camera) {
  const Eigen::Vector3d p = T.translation();
  const Eigen::Matrix3d R = T.linear();
  std::string text = std::string("{") + (camera ? "axes: link, " : "") + "x: " + length(p.x()) +
                     ", y: " + length(p.y()) + ", z: " + length(p.z());
  const double roll = std::atan2(R(2, 1), R(2, 2)), pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  for (const auto& [key, angle] : {std::pair{"roll", roll}, {"pitch", pitch}, {"yaw", yaw}}) {
    if (std::abs(angle) > 1e-5)
      text += std::string(", ") + key + ": " + format("%.3f deg", angle * 180 / std::numbers::pi);
  }
  return text + "}";
}

class Writer {
 public:
  Writer(const UrdfOutline& urdf, const std::optional<LogSurvey>& log, const Ask& ask)
      : urdf_(urdf), log_(log), ask_(ask) {}

  std::string write() {
    head();
    laser();
    camera();
    depth();
    imu();
    body();
    limits();
    return std::move(text_);
  }

 private:
  void line(const std::string& content, const std::string& source = "") {
    const std::size_t column = std::max<std::size_t>(content.size() + 2, 40);
    text_ += content;
    if (!source.empty()) text_ += std::string(column - content.size(), ' ') + "# " + source;
    text_ += '\n';
  }

  void head() {
    line("# Robot description. [urdf], [log], [answer]: where a value comes from. [guess]: measure it, see");
    line("# docs/connect-your-robot.md; then `parhelion calibrate` and `parhelion robot check`.");
    line("# base_link lies on the floor below the frame of the URDF's '" + urdf_.root + "'.");
    line("name: " + ask_("Name of the robot", urdf_.name));
  }

  /// The link of a sensor; empty: the robot has none.
  std::string link_of(const std::string& sensor, const std::vector<std::string>& words) {
    const auto likely = links_named(urdf_, words);
    const std::string link =
        ask_("Link of the " + sensor + " (- for none)", likely.empty() ? "-" : likely.front());
    if (link == "-") return "";
    if (!urdf_.T_base_link.contains(link)) {
      throw Wrong{"the URDF has no link '" + link + "'" + suggestion(link, urdf_.links)};
    }
    return link;
  }

  std::string number(const std::string& question, const std::string& likely) {
    const std::string answer = ask_(question, likely);
    double value = 0;
    const auto [end, error] = std::from_chars(answer.data(), answer.data() + answer.size(), value);
    if (error != std::errc{} || end != answer.data() + answer.size() || !(value >= 0) ||
        !std::isfinite(value))
      throw Wrong{question + ": expected a number of at least 0, found '" + answer + "'"};
    return answer;
  }
  /// A value that only a person knows, with its source.
  void asked(const std::string& key, const std::string& question, const std::string& likely,
             const std::string& unit) {
    const std::string answer = number(question, likely);
    line(key + ": " + answer + unit, answer == likely ? "[guess]" : "[answer]");
  }

  void laser() {
    const bool seen = log_ && log_->laser;
    const std::string link = link_of("laser on SCAN", {"scan", "laser", "hokuyo", "sick", "lidar"});
    if (link.empty() && !seen) return;
    if (link.empty()) throw Wrong{"the log has scans: name the link of the laser that they come from"};
    line("laser:");
    line("  pose: " + pose_text(urdf_.T_base_link.at(link), false), "[urdf] " + link);
    if (seen) {
      laser_from_log();
    } else {
      asked("  range_max", "Greatest range of the laser, m", "10", " m");
      asked("  scan_period", "Time of one scan, s", "0.1", " s");
    }
    const std::string stamp = ask_("Beam that a scan's stamp means: first, middle or last", "first");
    if (stamp != "first" && stamp != "middle" && stamp != "last")
      throw Wrong{"beam of the stamp: expected first, middle or last, found '" + stamp + "'"};
    line("  stamp_beam: " + stamp, "[guess] read the driver");
  }

  /// The limits in the log's own description, such as of a laser preset, where no range in the log is outside
  /// them: the robot need not have met its sensor's limits.
  bool take_described_ranges(RangeConvention& ranges) const {
    if (log_->robot_yaml.empty()) return false;
    const auto robot = parse_robot_description(log_->robot_yaml, log_->path + ", ROBOT");
    if (!robot || !robot->laser) return false;
    const RangeConvention& known = robot->laser->convention;
    const LaserSurvey& survey = *log_->laser;
    if (known.range_min > survey.min_range || known.range_max < survey.max_range) return false;
    if (survey.repeated && known.range_max > *survey.repeated) return false;
    ranges.range_min = known.range_min;
    ranges.range_max = known.range_max;
    return true;
  }

  void laser_from_log() {
    const LaserSurvey& survey = *log_->laser;
    LaserDescription laser = laser_seen(survey);
    const RangeConvention& ranges = laser.convention;
    using Sentinel = RangeConvention::Sentinel;
    const bool described = take_described_ranges(laser.convention);
    const char* source = "[log] ROBOT";
    line("  range_min: " + length(std::floor(double{ranges.range_min} * 1e4 + 1e-3) / 1e4),
         described ? source : "[log] least range seen; the data sheet's is better");
    line("  range_max: " + length(std::ceil(double{ranges.range_max} * 1e4 - 1e-3) / 1e4),
         described         ? source
         : survey.repeated ? "[log] the value without a return"
                           : "[log] greatest range seen; the data sheet's is better");
    const std::string no_return = ranges.no_return == Sentinel::infinity ? "infinity"
                                  : ranges.no_return == Sentinel::nan
                                      ? "nan"
                                      : length(double{ranges.no_return_value});
    line("  no_return: " + no_return, "[log] " + no_return_fraction(survey));
    if (ranges.too_close == Sentinel::nan) {
      line("  too_close: nan", "[guess] 0 is no return");
    } else if (survey.zero > 0) {
      line("  too_close: 0 m", "[log] zeros occur");
    }
    line("  scan_period: " + format("%.4g s", laser.scan_period), "[log] median of the stamps");
    line("  beam_interval: " + format("%.4g s", laser.beam_interval),
         "[log] [guess] of a mirror that turns once a scan");
    line("  beams: " + std::to_string(laser.beams), "[log]");
    line("  angle_min: " + degrees(laser.angle_min), "[log]");
    line("  angle_increment: " + degrees(laser.angle_increment), "[log]");
    if (laser.intensities) line("  intensities: true", "[log]");
    const auto learned = scan::learn_laser(survey.scans, laser);
    if (!learned) {
      line("  noise_sigma: 0.01 m", "[guess] " + learned.error().message);
      return;
    }
    line("  noise_sigma: " + length(learned->sigma), "[log] from returns on walls");
    if (learned->quantization > 0) line("  quantization: " + length(learned->quantization), "[log]");
  }

  static std::string no_return_fraction(const LaserSurvey& survey) {
    const double share =
        survey.repeated ? survey.repeated_fraction : std::max({survey.infinite, survey.nan, survey.zero});
    return share > 0 ? format("%.1f %% of the beams", 100 * share) : "[guess] no beam without a return";
  }

  void image_size(const std::optional<ImageSurvey>& seen) {
    if (seen) {
      line("  width: " + std::to_string(seen->width), "[log]");
      line("  height: " + std::to_string(seen->height), "[log]");
    } else {
      asked("  width", "Width of its images, pixels", "640", "");
      asked("  height", "Height of its images, pixels", "480", "");
    }
    const double width = seen ? seen->width : 640, height = seen ? seen->height : 480;
    const std::string focal = number("Focal length of the camera, pixels",
                                     format("%.0f", width / 2 / std::tan(std::numbers::pi / 6)));
    line("  fx: " + focal + " px", "[guess] calibrate the camera");
    line("  fy: " + focal + " px", "[guess]");
    line("  cx: " + format("%.1f px", (width - 1) / 2), "[guess]");
    line("  cy: " + format("%.1f px", (height - 1) / 2), "[guess]");
    if (seen && seen->period > 0) line("  rate: " + format("%.3g Hz", 1 / seen->period), "[log]");
  }

  /// A camera's pose with the axes of a link: x forward. A URDF marks the other kind by its name.
  void camera_pose(const std::string& link) {
    Eigen::Isometry3d T = urdf_.T_base_link.at(link);
    if (link.find("optical") != std::string::npos) {
      Eigen::Matrix3d R_optical_link;  // x forward is the optical z
      R_optical_link << 0, -1, 0, 0, 0, -1, 1, 0, 0;
      T.linear() = T.linear() * R_optical_link;
    }
    line("  pose: " + pose_text(T, true), "[urdf] " + link);
  }

  void camera() {
    if (log_ && !log_->camera) return;
    const std::string link = link_of("camera on CAMERA", {"camera", "rgb", "color", "rgb_camera_optical"});
    if (link.empty()) return;
    line("camera:");
    camera_pose(link);
    image_size(log_ ? log_->camera : std::nullopt);
  }

  void depth() {
    if (!log_ || !log_->depth) return;
    const std::string link = link_of("depth camera on DEPTH", {"camera", "depth", "depth_optical"});
    if (link.empty()) return;
    line("depth:");
    camera_pose(link);
    image_size(log_->depth);
  }

  void imu() {
    if (log_ && !log_->imu) return;
    const std::string link = link_of("inertial sensor on IMU", {"imu"});
    if (link.empty()) return;
    line("imu:");
    line("  pose: " + pose_text(urdf_.T_base_link.at(link), false), "[urdf] " + link);
  }

  void body() {
    if (urdf_.footprint.size() < 3) throw Wrong{"the URDF has no shapes: its outline is unknown"};
    std::string corners;
    for (const Eigen::Vector2d& c : urdf_.footprint)
      corners += (corners.empty() ? "" : ", ") + ("[" + length(c.x()) + ", " + length(c.y()) + "]");
    line("# [urdf] outline of all parts, joints at zero");
    line("footprint: [" + corners + "]");
    line("height: " + length(urdf_.height), "[urdf]");
    if (urdf_.mass > 0) line("mass: " + format("%.4g kg", urdf_.mass), "[urdf] sum of the links");
  }

  void limits() {
    const bool seen = log_ && log_->odometry && log_->odometry->speed > 0;
    line("limits:");
    asked("  speed", "Greatest speed, m/s", seen ? format("%.2f", log_->odometry->speed) : "0.5", " m/s");
    asked("  yaw_rate", "Greatest yaw rate, rad/s",
          seen ? format("%.2f", std::max(0.1, log_->odometry->yaw_rate)) : "1", " rad/s");
    asked("  deceleration", "Deceleration of a stop, m/s^2", "0.5", " m/s^2");
    asked("  reaction_time", "Time from a command to the motion, s", "0.3", " s");
  }

  const UrdfOutline& urdf_;
  const std::optional<LogSurvey>& log_;
  const Ask& ask_;
  std::string text_;
};

}  // namespace

Result<std::string> new_description(const UrdfOutline& urdf, const std::optional<LogSurvey>& log,
                                    const Ask& ask) {
  try {
    return Writer(urdf, log, ask).write();
  } catch (const Wrong& wrong) {
    return Error{wrong.words};
  }
}

}  // namespace parhelion::tools

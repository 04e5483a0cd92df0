#include "tools/robot/new_description.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/nearest_name.hpp"
#include "tools/robot/description_text.hpp"
#include "tools/robot/footprint_text.hpp"
#include "tools/robot/new_lasers.hpp"

namespace parhelion::tools {
namespace {

class Writer {
 public:
  Writer(const UrdfOutline& urdf, const std::optional<LogSurvey>& log, const Dialogue& dialogue,
         const GivenParts& given)
      : urdf_(urdf), log_(log), dialogue_(dialogue), given_(given) {}

  NewDescription write() {
    head();
    if (!write_lasers({urdf_, log_, given_.lasers, dialogue_}, text_, notes_)) {
      notes_.push_back(
          "no link of the URDF is named like a laser: the description has none, and `parhelion serve` "
          "refuses "
          "it; give the laser with --laser LINK, or --laser X,Y,Z,YAW in m and degrees");
    }
    camera();
    depth();
    imu();
    body();
    limits();
    return {text_.take(), std::move(notes_)};
  }

 private:
  void head() {
    text_.line(
        "# Robot description. [urdf], [log], [answer]: where a value comes from. [guess]: measure it, see");
    text_.line("# docs/connect-your-robot.md; then `parhelion calibrate` and `parhelion robot check`.");
    text_.line("# base_link lies on the floor below the frame of the URDF's '" + urdf_.root + "'.");
    text_.line("name: " + dialogue_.answer("Name of the robot", urdf_.name,
                                           [](const std::string& answer) { return answer; }));
  }

  /// The link of a sensor; empty: the robot has none.
  std::string link_of(const std::string& sensor, const std::vector<std::string>& words) {
    const auto likely = links_named(urdf_, words);
    return dialogue_.answer(
        "Link of the " + sensor + " (- for none)", likely.empty() ? "-" : likely.front(),
        [&](const std::string& link) {
          if (link == "-") return std::string();
          if (!urdf_.T_base_link.contains(link)) {
            throw WrongAnswer{"the URDF has no link '" + link + "'" + suggestion(link, urdf_.links)};
          }
          return link;
        });
  }

  /// A value that only a person knows, with its source.
  void asked(const std::string& key, const std::string& question, const std::string& likely,
             const std::string& unit) {
    const std::string answer = dialogue_.number(question, likely);
    text_.line(key + ": " + answer + unit, answer == likely ? "[guess]" : "[answer]");
  }

  void image_size(const std::optional<ImageSurvey>& seen) {
    if (seen) {
      text_.line("  width: " + std::to_string(seen->width), "[log]");
      text_.line("  height: " + std::to_string(seen->height), "[log]");
    } else {
      asked("  width", "Width of its images, pixels", "640", "");
      asked("  height", "Height of its images, pixels", "480", "");
    }
    const double width = seen ? seen->width : 640, height = seen ? seen->height : 480;
    const std::string focal = dialogue_.number("Focal length of the camera, pixels",
                                               formatted("%.0f", width / 2 / std::tan(std::numbers::pi / 6)));
    text_.line("  fx: " + focal + " px", "[guess] calibrate the camera");
    text_.line("  fy: " + focal + " px", "[guess]");
    text_.line("  cx: " + formatted("%.1f px", (width - 1) / 2), "[guess]");
    text_.line("  cy: " + formatted("%.1f px", (height - 1) / 2), "[guess]");
    if (seen && seen->period > 0) text_.line("  rate: " + formatted("%.3g Hz", 1 / seen->period), "[log]");
  }

  /// A camera's pose with the axes of a link: x forward. A URDF marks the other kind by its name.
  void camera_pose(const std::string& link) {
    Eigen::Isometry3d T = urdf_.T_base_link.at(link);
    if (link.find("optical") != std::string::npos) {
      Eigen::Matrix3d R_optical_link;  // x forward is the optical z
      R_optical_link << 0, -1, 0, 0, 0, -1, 1, 0, 0;
      T.linear() = T.linear() * R_optical_link;
    }
    text_.line("  pose: " + pose_text(T, true), "[urdf] " + link);
  }

  void camera() {
    if (log_ && !log_->camera) return;
    const std::string link = link_of("camera on CAMERA", {"camera", "rgb", "color", "rgb_camera_optical"});
    if (link.empty()) return;
    text_.line("camera:");
    camera_pose(link);
    image_size(log_ ? log_->camera : std::nullopt);
  }

  void depth() {
    if (!log_ || !log_->depth) return;
    const std::string link = link_of("depth camera on DEPTH", {"camera", "depth", "depth_optical"});
    if (link.empty()) return;
    text_.line("depth:");
    camera_pose(link);
    image_size(log_->depth);
  }

  void imu() {
    if (log_ && !log_->imu) return;
    const std::string link = link_of("inertial sensor on IMU", {"imu"});
    if (link.empty()) return;
    text_.line("imu:");
    text_.line("  pose: " + pose_text(urdf_.T_base_link.at(link), false), "[urdf] " + link);
  }

  void body() {
    footprint();
    if (urdf_.height > 0) {
      text_.line("height: " + metres_text(urdf_.height),
                 urdf_.left_out.empty() ? "[urdf]" : "[urdf] of the parts that could be read: measure it");
    } else {
      asked("height", "Height of the robot, m", "0.5", " m");
    }
    if (urdf_.mass > 0) text_.line("mass: " + formatted("%.4g kg", urdf_.mass), "[urdf] sum of the links");
  }

  void footprint() {
    const std::string lacking = urdf_.left_out.empty() ? "" : missing_parts(urdf_);
    if (!given_.footprint.empty())
      return footprint_line(read_footprint(given_.footprint), "[answer] outline");
    if (urdf_.footprint.size() >= 3 && !urdf_.lacks_base) {
      if (!lacking.empty())
        notes_.push_back("the outline lacks " + lacking + ": measure the robot, and give --footprint");
      return footprint_line(urdf_.footprint, lacking.empty()
                                                 ? "[urdf] outline of all parts, joints at zero"
                                                 : "[urdf] outline without " + lacking + ": measure it");
    }
    const std::string why =
        lacking.empty() ? "the URDF has no shapes" : "what could be read of the URDF lacks " + lacking;
    const auto corners = dialogue_.answer(
        "Outline of the robot (" + why + "): length,width about base_link, or corners x,y x,y x,y, m", "",
        [&](const std::string& answer) {
          if (answer.empty()) {
            throw WrongAnswer{
                why +
                ": its outline is unknown. Give it with --footprint LENGTH,WIDTH (m, about "
                "base_link) or --footprint \"X,Y X,Y X,Y\" (corners)" +
                (lacking.empty() ? "" : ", or put the meshes where they are found (ROS_PACKAGE_PATH)")};
          }
          return read_footprint(answer);
        });
    footprint_line(corners, "[answer] outline");
  }

  void footprint_line(const std::vector<Eigen::Vector2d>& outline, const std::string& source) {
    std::string corners;
    for (const Eigen::Vector2d& c : outline)
      corners += (corners.empty() ? "" : ", ") + ("[" + metres_text(c.x()) + ", " + metres_text(c.y()) + "]");
    text_.line("# " + source);
    text_.line("footprint: [" + corners + "]");
  }

  void limits() {
    const bool seen = log_ && log_->odometry && log_->odometry->speed > 0;
    text_.line("limits:");
    asked("  speed", "Greatest speed, m/s", seen ? formatted("%.2f", log_->odometry->speed) : "0.5", " m/s");
    asked("  yaw_rate", "Greatest yaw rate, rad/s",
          seen ? formatted("%.2f", std::max(0.1, log_->odometry->yaw_rate)) : "1", " rad/s");
    asked("  deceleration", "Deceleration of a stop, m/s^2", "0.5", " m/s^2");
    asked("  reaction_time", "Time from a command to the motion, s", "0.3", " s");
  }

  const UrdfOutline& urdf_;
  const std::optional<LogSurvey>& log_;
  const Dialogue& dialogue_;
  const GivenParts& given_;
  DescriptionText text_;
  std::vector<std::string> notes_;
};

}  // namespace

Result<NewDescription> new_description(const UrdfOutline& urdf, const std::optional<LogSurvey>& log,
                                       const Dialogue& dialogue, const GivenParts& given) {
  try {
    return Writer(urdf, log, dialogue, given).write();
  } catch (const WrongAnswer& wrong) {
    return Error{wrong.words};
  }
}

}  // namespace parhelion::tools

#include "tools/map/image_frames.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/robot.hpp"
#include "render/colour_image.hpp"
#include "render/depth_image.hpp"
#include "tools/each_event.hpp"
#include "tools/log_poses.hpp"

namespace parhelion::tools {
namespace {

constexpr Duration kSameInstant = milliseconds(20);

/// Which of the images of a camera are used: those from new places.
class Selection {
 public:
  explicit Selection(double scale) : scale_(scale) {}
  bool take(const Eigen::Isometry3d& now, const ImageFrameOptions& options) {
    if (options.wanted && !options.wanted(now)) return false;
    if (last_) {
      const Eigen::Isometry3d between = last_->inverse(Eigen::Isometry) * now;
      if (between.translation().norm() < scale_ * options.distance &&
          Eigen::AngleAxisd(between.linear()).angle() < scale_ * options.angle)
        return false;
    }
    last_ = now;
    return true;
  }

 private:
  double scale_;
  std::optional<Eigen::Isometry3d> last_;
};

semantic::Pinhole pinhole_of(const render::PinholeView& view) {
  return {view.width, view.height, view.fx, view.fy, view.cx, view.cy};
}

bool is_calibrated(const CameraIntrinsics& camera) {
  return render::intrinsics_for_size(camera, camera.width, camera.height).ok();
}

class Reader {
 public:
  Reader(const std::string& name, const ImageFrameOptions& options) : name_(name), options_(options) {}

  Result<ImageFrames> read() {
    if (const Status status = each_event([this](const Message& event) { return handle_pose(event); });
        !status)
      return status.error();
    poses_.finish();
    if (const Status status = check(); !status) return status.error();
    // Once to count, as images are large.
    double scale = 1;
    while (count(scale) > max_images()) scale *= 1.5;
    colour_selection_ = Selection(scale), depth_selection_ = Selection(0.5 * scale);
    if (const Status status = each_event([this](const Message& event) { return take_image(event); }); !status)
      return status.error();
    if (damaged_ > 0) note(std::to_string(damaged_) + " damaged events skipped");
    if (without_pose_ > 0) note(std::to_string(without_pose_) + " images left out: no pose");
    if (unusable_ > 0) note(std::to_string(unusable_) + " images left out: " + why_unusable_);
    if (frames_.colour.empty()) return Error{name_ + no_image()};
    return std::move(frames_);
  }

 private:
  std::size_t max_images() const {
    constexpr double kUsual = 640 * 480;
    const double pixels = std::max(
        kUsual, static_cast<double>(robot_->camera->intrinsics.width) * robot_->camera->intrinsics.height);
    return std::max<std::size_t>(
        1, static_cast<std::size_t>(static_cast<double>(options_.max_images) * kUsual / pixels));
  }

  template <class Take>
  Status each_event(Take take) {
    without_pose_ = 0;
    return tools::each_event(name_, damaged_, take);
  }

  Status handle_pose(const Message& event) {
    if (event.channel == channel::kRobot && !robot_ && options_.robot.empty()) return handle_robot(event);
    damaged_ += poses_.handle(event) ? 0 : 1;
    return {};
  }

  Status handle_robot(const Message& event) {
    RobotMessage message;
    if (Status status = decode(event.channel, event.payload, message); !status) return status;
    auto robot = parse_robot_description(message.yaml, name_ + ", channel ROBOT");
    if (!robot) return robot.error();
    robot_ = std::move(*robot);
    return {};
  }

  Status check() {
    if (!options_.robot.empty()) {
      auto robot = load_robot_description(options_.robot.string());
      if (!robot) return robot.error();
      robot_ = std::move(*robot);
    }
    if (!robot_) return Error{name_ + ": has no ROBOT event; describe the robot with --robot FILE"};
    if (poses_.empty())
      return Error{name_ + ": has no poses (POSE_COV or POSE); `parhelion slam --log` adds them"};
    if (!robot_->camera)
      return Error{name_ + ": its robot description has no camera, so that nothing gives the site a colour"};
    if (!is_calibrated(robot_->camera->intrinsics))
      return Error{name_ + ": the camera of its robot description is not calibrated; `parhelion calibrate`"};
    colour_lens_ = render::unwarp(robot_->camera->intrinsics);
    if (robot_->depth && is_calibrated(robot_->depth->intrinsics))
      depth_lens_ = render::unwarp(robot_->depth->intrinsics);
    return {};
  }

  std::string no_image() const {
    if (unusable_ > 0)
      return ": none of its " + std::to_string(unusable_) + " images is usable: " + why_unusable_;
    if (without_pose_ > 0)
      return ": none of its " + std::to_string(without_pose_) +
             " images has a pose at its time; `parhelion slam --log` adds poses";
    return ": has no CAMERA image";
  }

  template <class Optical>
  std::optional<Transform<Map, Optical>> pose_at(SensorTime t, const std::vector<HeadJoint>& head,
                                                 const Transform<Base, Optical>& T_base_optical) const {
    const auto T_map_base = poses_.base_at(t);
    const auto turn = poses_.turn_at(head, t);
    if (!T_map_base || !turn) return std::nullopt;
    return *T_map_base * *turn * T_base_optical;
  }

  SensorTime exposed(const Image& image) const { return image.stamp + seconds(robot_->camera->time_offset); }

  std::size_t count(double scale) {
    Selection selection(scale);
    colour_stamps_.clear();
    (void)each_event([&](const Message& event) {
      Image image;
      if (event.channel != channel::kCamera || !decode(event.channel, event.payload, image)) return Status();
      const auto T = pose_at(exposed(image), robot_->camera->head, robot_->camera->T_base_optical);
      if (T && selection.take(T->isometry(), options_)) colour_stamps_.insert(exposed(image));
      return Status();
    });
    return colour_stamps_.size();
  }

  /// Whether a colour image that is used was taken at the same instant.
  bool is_with_colour(SensorTime stamp) const {
    const auto next = colour_stamps_.lower_bound(stamp - kSameInstant);
    return next != colour_stamps_.end() && *next <= stamp + kSameInstant;
  }

  Status take_image(const Message& event) {
    if (event.channel == channel::kCamera) return take_colour(event);
    if (event.channel == channel::kDepth && depth_lens_) return handle_depth(event);
    return {};
  }

  Status leave_out(const std::string& why) {
    if (unusable_++ == 0) why_unusable_ = why;
    return {};
  }

  Status take_colour(const Message& event) {
    Image image;
    if (!decode(event.channel, event.payload, image)) return ++damaged_, Status();
    const auto T_map_optical = pose_at(exposed(image), robot_->camera->head, robot_->camera->T_base_optical);
    if (!T_map_optical) return ++without_pose_, Status();
    if (!colour_selection_.take(T_map_optical->isometry(), options_)) return {};
    auto pixels = render::decode_colour(image);
    if (!pixels) return leave_out(pixels.error().message);
    const semantic::Pinhole camera = pinhole_of(colour_lens_.view);
    if (pixels->width != camera.width || pixels->height != camera.height)
      return leave_out("an image of " + std::to_string(pixels->width) + "x" + std::to_string(pixels->height) +
                       " pixels, the camera is described with " + std::to_string(camera.width) + "x" +
                       std::to_string(camera.height));
    frames_.colour.push_back(
        {camera, *T_map_optical, render::unwarped(std::move(*pixels), colour_lens_).rgb, exposed(image)});
    return {};
  }

  Status handle_depth(const Message& event) {
    Image image;
    if (!decode(event.channel, event.payload, image)) return ++damaged_, Status();
    const auto T_map_optical = pose_at(image.stamp, robot_->depth->head, robot_->depth->T_base_optical);
    if (!T_map_optical) return ++without_pose_, Status();
    if (!depth_selection_.take(T_map_optical->isometry(), options_) && !is_with_colour(image.stamp))
      return {};
    auto pixels = render::decode_depth(image);
    if (!pixels) return leave_out(pixels.error().message);
    const semantic::Pinhole camera = pinhole_of(depth_lens_->view);
    if (pixels->width != camera.width || pixels->height != camera.height)
      return leave_out("a depth image of another size than its camera is described with");
    frames_.depth.push_back({camera, *T_map_optical,
                             render::unwarped(std::move(pixels->millimetres), camera.width, *depth_lens_),
                             image.stamp});
    return {};
  }

  void note(const std::string& text) { frames_.notes.push_back(name_ + ": " + text); }

  std::string name_;
  const ImageFrameOptions& options_;
  std::optional<RobotDescription> robot_;
  LogPoses poses_;
  render::Unwarp colour_lens_;
  std::optional<render::Unwarp> depth_lens_;
  std::set<SensorTime> colour_stamps_;  ///< of those that are used
  Selection colour_selection_{1}, depth_selection_{0.5};
  ImageFrames frames_;
  std::uint64_t damaged_ = 0, without_pose_ = 0, unusable_ = 0;
  std::string why_unusable_;
};

}  // namespace

Result<ImageFrames> read_image_frames(const std::string& log, const ImageFrameOptions& options) {
  return Reader(log, options).read();
}

}  // namespace parhelion::tools

// LCM logs as 3D scans: DEPTH images, LINES, or SCAN of a laser that is not level, with poses from POSE_COV
// or POSE.
#include <algorithm>
#include <map>

#include "fusion/cloud/sensor_cloud.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/robot.hpp"
#include "render/depth_image.hpp"
#include "tools/each_event.hpp"
#include "tools/log_poses.hpp"
#include "tools/map/scan_sources.hpp"

namespace parhelion::tools {
namespace {

/// A laser whose scan lines become 3D scans.
struct Sweep {
  LaserDescription laser;
  std::vector<HeadJoint> head;
  std::vector<Scan> lines;  ///< of the current 3D scan
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
};

class LogScans {
 public:
  LogScans(const std::filesystem::path& path, const ScanSourceOptions& options, OpenedScans& opened)
      : name_(path.string()), options_(options), opened_(opened) {}

  Status open() {
    if (Status status = each_event([this](const Message& event) { return handle_pose(event); }); !status)
      return status;
    poses_.finish();
    if (Status status = check(); !status) return status;
    const std::size_t before = opened_.scans.size();
    if (Status status = each_event([this](const Message& event) { return handle_scan(event); }); !status)
      return status;
    for (auto& [channel, sweep] : sweeps_) finish(sweep);
    if (damaged_ > 0) note(std::to_string(damaged_) + " damaged events skipped");
    if (without_pose_ > 0) note(std::to_string(without_pose_) + " images or scan lines left out: no pose");
    if (opened_.scans.size() > before) return {};
    return Error{name_ + ": no 3D scan in it: no DEPTH image and no scan line that has a pose"};
  }

 private:
  template <class Take>
  Status each_event(Take take) {
    return tools::each_event(name_, damaged_, take);
  }

  Status handle_pose(const Message& event) {
    if (event.channel == channel::kRobot && !robot_) return handle_robot(event);
    damaged_ += poses_.handle(event) ? 0 : 1;
    return {};
  }

  Status handle_robot(const Message& event) {
    RobotMessage message;
    if (Status status = decode(event.channel, event.payload, message); !status) return status;
    auto robot = options_.robot.empty() ? parse_robot_description(message.yaml, name_ + ", channel ROBOT")
                                        : load_robot_description(options_.robot.string());
    if (!robot) return robot.error();
    robot_ = std::move(*robot);
    return {};
  }

  Status check() {
    if (!robot_ && !options_.robot.empty()) {
      auto robot = load_robot_description(options_.robot.string());
      if (!robot) return robot.error();
      robot_ = std::move(*robot);
    }
    if (!robot_) return Error{name_ + ": has no ROBOT event; describe the robot with --robot FILE"};
    if (poses_.empty()) {
      return Error{name_ + ": has no poses (POSE_COV or POSE); `parhelion slam --log` adds them"};
    }
    if (!options_.tilt_joint.empty() && !poses_.has_joint(options_.tilt_joint)) {
      return Error{name_ + ": JOINT_STATE never contains the joint " + options_.tilt_joint};
    }
    find_sweeps();
    return {};
  }

  /// Lines of a level laser stay in one plane, which is no 3D scan.
  void find_sweeps() {
    if (robot_->laser && !options_.tilt_joint.empty()) {
      const Transform<Base, Laser>& T_base_laser = robot_->laser->T_base_laser;
      const HeadJoint tilt{options_.tilt_joint, T_base_laser.translation(),
                           T_base_laser.rotation() * Eigen::Vector3d::UnitY()};
      sweeps_[channel::kScan] = {*robot_->laser, {tilt}, {}, {}};
    } else if (robot_->laser && !cloud::lies_level(*robot_->laser)) {
      sweeps_[channel::kScan] = {*robot_->laser, {}, {}, {}};
    }
    if (robot_->line_laser)
      sweeps_[channel::kLines] = {robot_->line_laser->laser, robot_->line_laser->head, {}, {}};
  }

  Status handle_scan(const Message& event) {
    if (event.channel == channel::kDepth && robot_->depth) return handle_depth(event);
    const auto sweep = sweeps_.find(event.channel);
    return sweep == sweeps_.end() ? Status() : handle_line(sweep->second, event);
  }

  Status handle_depth(const Message& event) {
    Image image;
    if (!decode(event.channel, event.payload, image)) return ++damaged_, Status();
    const auto T_map_base = poses_.base_at(image.stamp);
    if (!T_map_base) return ++without_pose_, Status();
    const auto turn = poses_.turn_at(robot_->depth->head, image.stamp);
    if (!turn) return ++without_pose_, Status();
    const Transform<Map, DepthOptical> T_map_optical = *T_map_base * *turn * robot_->depth->T_base_optical;
    if (last_image_ && !moved_enough(*last_image_, T_map_optical.isometry(), options_)) return {};
    const auto pixels = render::decode_depth(image);
    if (!pixels) return ++damaged_, Status();
    cloud::DepthCloudOptions depth;
    depth.step = options_.pixel_step;
    depth.range_min = robot_->depth->range_min;
    if (robot_->depth->range_max > depth.range_min) depth.range_max = robot_->depth->range_max;
    const auto cloud = cloud::cloud_from_depth(pixels->millimetres, robot_->depth->intrinsics, depth);
    if (!cloud) return Error{name_ + ", channel DEPTH: " + cloud.error().message};
    if (cloud->empty()) return {};
    last_image_ = T_map_optical.isometry();
    add(image.stamp, cloud::turned_level(*cloud, T_map_optical), T_map_optical.translation());
    return {};
  }

  Status handle_line(Sweep& sweep, const Message& event) {
    Scan line;
    if (!decode(event.channel, event.payload, line)) return ++damaged_, Status();
    const auto T_map_base = poses_.base_at(line.stamp);
    const auto turn = poses_.turn_at(sweep.head, line.stamp);
    if (!T_map_base || !turn) return ++without_pose_, Status();
    const Eigen::Vector3d here = T_map_base->translation();
    if (!sweep.lines.empty() && (here - sweep.start).norm() > options_.line_distance) finish(sweep);
    if (sweep.lines.empty()) sweep.start = here;
    cloud::leave_out_body(line, sweep.laser, *turn * sweep.laser.T_base_laser,
                          {robot_->footprint, robot_->height});
    sweep.lines.push_back(std::move(line));
    return {};
  }

  void finish(Sweep& sweep) {
    if (sweep.lines.empty()) return;
    const Transform<Scanner, Map> T_scanner_map(Eigen::Quaterniond::Identity(), -sweep.start);
    const auto pose_at = [&](SensorTime t) -> std::optional<Transform<Scanner, Laser>> {
      const auto T_map_base = poses_.base_at(t);
      const auto turn = poses_.turn_at(sweep.head, t);
      if (!T_map_base || !turn) return std::nullopt;
      return T_scanner_map * (*T_map_base * *turn * sweep.laser.T_base_laser);
    };
    auto scan = cloud::cloud_from_lines(sweep.lines, sweep.laser, pose_at);
    const SensorTime stamp = sweep.lines.front().stamp;
    sweep.lines.clear();
    if (!scan) return note(std::string("scan lines left out: ") + scan.error().message);
    without_pose_ += scan->without_pose;
    add(stamp, std::move(scan->cloud), sweep.start);
  }

  void add(SensorTime stamp, cloud::PointCloud<Scanner> cloud, const Eigen::Vector3d& place) {
    const std::int64_t utime = stamp.utime();
    opened_.scans.push_back({name_ + " at utime " + std::to_string(utime),
                             std::move(cloud),
                             {Eigen::Quaterniond::Identity(), place},
                             true});
  }
  void note(const std::string& text) { opened_.notes.push_back(name_ + ": " + text); }

  std::string name_;
  const ScanSourceOptions& options_;
  OpenedScans& opened_;
  std::optional<RobotDescription> robot_;
  LogPoses poses_;
  std::map<std::string, Sweep> sweeps_;  ///< by channel
  std::optional<Eigen::Isometry3d> last_image_;
  std::uint64_t damaged_ = 0, without_pose_ = 0;
};

}  // namespace

Status open_log_scans(const std::filesystem::path& log, const ScanSourceOptions& options,
                      OpenedScans& opened) {
  return LogScans(log, options, opened).open();
}

}  // namespace parhelion::tools

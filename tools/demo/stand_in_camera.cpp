#include "tools/demo/stand_in_camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/robot.hpp"

namespace parhelion::tools {
namespace {

constexpr Duration kTransfer = milliseconds(5);  // from exposure to arrival
constexpr Duration kLongestGap =
    seconds(2.0);  // between two poses; over a longer gap the camera pose is unknown

struct Recording {
  std::vector<Message> events;
  std::vector<PoseEstimate> poses;  // ascending stamp
  RobotDescription robot;
};

Result<Recording> read(const std::string& path) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  Recording recording;
  bool have_robot = false;
  while (true) {
    auto next = reader->next();
    if (!next) return next.error();
    if (!*next) break;
    const Message& message = **next;
    if (message.channel == channel::kPoseCov) {
      PoseEstimate pose;
      if (const Status ok = decode(message.channel, message.payload, pose); !ok) return ok.error();
      const bool later = recording.poses.empty() || recording.poses.back().stamp < pose.stamp;
      if (pose.state == SlamState::tracking && later) recording.poses.push_back(pose);
    } else if (message.channel == channel::kRobot && !have_robot) {
      RobotMessage robot;
      if (const Status ok = decode(message.channel, message.payload, robot); !ok) return ok.error();
      auto description = parse_robot_description(robot.yaml, path + " (ROBOT)");
      if (!description) return description.error();
      recording.robot = std::move(*description);
      have_robot = true;
    }
    recording.events.push_back(std::move(**next));
  }
  if (!have_robot) return Error{path + ": no ROBOT message; expected one as the first event"};
  if (recording.poses.size() < 2)
    return Error{path + ": fewer than two poses on POSE_COV; run `parhelion slam` over it first"};
  return recording;
}

/// Images between the first and the last pose, as CAMERA messages.
std::vector<Message> shoot(const Recording& recording, render::VirtualCamera& camera, double rate,
                           const std::function<void(double, double)>& progress) {
  std::vector<Message> images;
  const auto& poses = recording.poses;
  const Duration period = seconds(1 / rate);
  const double total = (poses.back().stamp - poses.front().stamp).seconds() * rate;
  std::size_t after = 1;
  WorldSnapshot nobody;
  nobody.scene = std::make_shared<Scene>();
  for (SensorTime t = poses.front().stamp; t <= poses.back().stamp; t = t + period) {
    while (after + 1 < poses.size() && poses[after].stamp < t) ++after;
    const PoseEstimate &a = poses[after - 1], &b = poses[after];
    if (b.stamp - a.stamp > kLongestGap) continue;
    const double s = (t - a.stamp).seconds() / (b.stamp - a.stamp).seconds();
    const auto T_map_optical =
        interpolate(a.T_map_base, b.T_map_base, s) * recording.robot.camera->T_base_optical;
    const Image image =
        camera.render(*recording.robot.camera, T_map_optical, nobody, t, "rendered from the extruded model");
    Message message{channel::kCamera, ArrivalTime{t.ns} + kTransfer, {}};
    encode(image, message.payload);
    images.push_back(std::move(message));
    if (progress) progress(static_cast<double>(images.size()), total);
  }
  return images;
}

}  // namespace

CameraDescription stand_in_camera(double height) {
  CameraDescription camera;
  CameraIntrinsics& lens = camera.intrinsics;
  lens.width = 640;
  lens.height = 480;
  lens.fx = lens.fy = 320 / std::tan(37.5 * std::numbers::pi / 180);
  lens.cx = 319.5;
  lens.cy = 239.5;
  // Optical axes of a camera that looks along x and `down` below the horizon.
  const double down = 8 * std::numbers::pi / 180;
  Eigen::Matrix3d R_base_optical;
  R_base_optical.col(0) = Eigen::Vector3d(0, -1, 0);
  R_base_optical.col(2) = Eigen::Vector3d(std::cos(down), 0, -std::sin(down));
  R_base_optical.col(1) = R_base_optical.col(2).cross(R_base_optical.col(0));
  camera.T_base_optical = {Eigen::Quaterniond(R_base_optical), {0.2, 0, height}};
  camera.source = "stand-in: rendered from the model, not a real camera";
  return camera;
}

Result<std::uint64_t> add_stand_in_camera(const std::string& in, const std::string& out, bool overwrite,
                                          render::VirtualCamera& camera, double rate,
                                          const std::function<void(double done, double total)>& progress) {
  auto recording = read(in);
  if (!recording) return recording.error();
  recording->robot.camera = stand_in_camera(1.0);
  std::vector<Message> events = shoot(*recording, camera, rate, progress);
  const std::uint64_t images = events.size();

  for (Message& event : recording->events) {
    if (event.channel == channel::kRobot) {
      RobotMessage robot;
      if (const Status ok = decode(event.channel, event.payload, robot); !ok) return ok.error();
      robot.yaml = to_yaml(recording->robot);
      encode(robot, event.payload);
    }
  }
  std::vector<Message> all = std::move(recording->events);
  std::move(events.begin(), events.end(), std::back_inserter(all));
  std::stable_sort(all.begin(), all.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });

  auto writer = LogWriter::create(out, overwrite);
  if (!writer) return writer.error();
  for (const Message& event : all) {
    if (const Status written = writer->write(event.channel, event.arrival, event.payload); !written)
      return written.error();
  }
  return images;
}

}  // namespace parhelion::tools

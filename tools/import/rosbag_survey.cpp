#include "tools/import/rosbag_survey.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "protocols/channels.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/ros_camera.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kLaserScan = "sensor_msgs/LaserScan";
constexpr const char* kMultiEchoLaserScan = "sensor_msgs/MultiEchoLaserScan";
constexpr const char* kImage = "sensor_msgs/Image";
constexpr const char* kCompressedImage = "sensor_msgs/CompressedImage";
constexpr const char* kCameraInfo = "sensor_msgs/CameraInfo";
constexpr const char* kOdometry = "nav_msgs/Odometry";
constexpr const char* kPoseStamped = "geometry_msgs/PoseStamped";
constexpr const char* kString = "std_msgs/String";
constexpr const char* kTwist = "geometry_msgs/Twist";
constexpr const char* kTwistStamped = "geometry_msgs/TwistStamped";
constexpr const char* kImu = "sensor_msgs/Imu";
constexpr const char* kJointState = "sensor_msgs/JointState";

/// What a scan message states about its laser.
void record_stated_values(const std::string& topic, const ros::LaserScan& scan, LaserEvidence& evidence) {
  const auto stated = [](float value) { return std::isfinite(value) && value > 0 ? value : 0; };
  evidence.range_min = stated(scan.range_min);
  evidence.range_max = stated(scan.range_max);
  evidence.beam_interval = stated(std::abs(scan.time_increment));
  evidence.scan_period = stated(scan.scan_time);
  // sensor_msgs/LaserScan: "timestamp in the header is the acquisition time of the first ray".
  evidence.stamp_beam =
      scan.time_increment < 0 ? LaserDescription::StampBeam::last : LaserDescription::StampBeam::first;
  char text[400];
  std::snprintf(text, sizeof text,
                "LaserScan %.80s: frame %.60s, angle_min %.9g, angle_max %.9g, angle_increment %.9g rad, "
                "time_increment "
                "%.9g s, scan_time %.9g s, range_min %.9g, range_max %.9g m",
                topic.c_str(), scan.header.frame.c_str(), static_cast<double>(scan.angle_min),
                static_cast<double>(scan.angle_max), static_cast<double>(scan.angle_increment),
                static_cast<double>(scan.time_increment), static_cast<double>(scan.scan_time),
                static_cast<double>(scan.range_min), static_cast<double>(scan.range_max));
  evidence.source = text;
}

std::string name_of(const RosFrames::Key& edge) { return "tf:" + edge.first + "->" + edge.second; }

bool is_static_tf(const std::string& topic) { return topic.ends_with("tf_static"); }

std::string folder_of(const std::string& topic) { return topic.substr(0, topic.rfind('/')); }

/// CameraInfo topics beside the images (also beside image_raw/compressed), else those of the images' frame.
std::vector<std::string> infos_of(const BagSurvey& survey, const std::string& image_topic) {
  std::vector<std::string> beside, same_frame;
  for (const auto& [topic, info] : survey.cameras) {
    const std::string folder = folder_of(topic);
    if (folder == folder_of(image_topic) || folder == folder_of(folder_of(image_topic)))
      beside.push_back(topic);
    if (info.header.frame == survey.topics.at(image_topic).frame) same_frame.push_back(topic);
  }
  return beside.empty() ? same_frame : beside;
}

std::vector<std::string> image_topics(const BagSurvey& survey, bool depth) {
  std::vector<std::string> found;
  for (const auto& [name, topic] : survey.topics) {
    const bool is_image = topic.type == kImage || topic.type == kCompressedImage;
    if (is_image && is_depth_encoding(topic.encoding) == depth) found.push_back(name);
  }
  return found;
}

std::vector<std::string> colour_topics(const BagSurvey& survey) { return image_topics(survey, false); }

std::vector<std::string> depth_topics(const BagSurvey& survey) { return image_topics(survey, true); }

Result<std::optional<std::string>> choose_reference(const ImportOptions& options, const BagSurvey& survey) {
  std::vector<std::string> candidates = survey.of_type(kPoseStamped), truths;
  for (const std::string& topic : candidates) {
    if (topic.find("truth") != std::string::npos || topic.find("reference") != std::string::npos)
      truths.push_back(topic);
  }
  const bool asked = options.topics.count(channel::kReferencePose) > 0;
  if (!asked && truths.size() == 1) candidates = truths;
  return choose_topic(options, channel::kReferencePose, candidates, kPoseStamped);
}

/// A topic has priority over tf, which has the same content in most bags, if a message of it can be read.
Status choose_odometry(const ImportOptions& options, const BagSurvey& survey, BagChoice& choice) {
  std::vector<std::string> candidates = survey.of_type(kOdometry);
  const bool asked = options.topics.count(channel::kOdometry) > 0;
  const auto edges = survey.frames.odometry_edges();
  const auto is_unreadable = [&](const std::string& topic) { return survey.topics.at(topic).count == 0; };
  if (!asked && (!edges.empty() || !std::all_of(candidates.begin(), candidates.end(), is_unreadable))) {
    const auto readable = std::stable_partition(candidates.begin(), candidates.end(), is_unreadable);
    choice.unreadable_odometry.assign(candidates.begin(), readable);
    candidates.erase(candidates.begin(), readable);
  }
  if (candidates.empty() || asked) {
    for (const RosFrames::Key& edge : edges) candidates.push_back(name_of(edge));
  }
  const auto chosen = choose_topic(options, channel::kOdometry, candidates, "odometry");
  if (!chosen) return chosen.error();
  choice.odometry = *chosen;
  for (const RosFrames::Key& edge : edges) {
    if (*chosen && **chosen == name_of(edge)) choice.odometry_edge = edge;
  }
  return {};
}

/// Topics for SCAN_<name>, which are taken out of `candidates`.
Status choose_further_scans(const ImportOptions& options, std::vector<std::string>& candidates,
                            BagChoice& choice) {
  for (const auto& [channel, topic] : options.topics) {
    if (!is_further_scan(channel) || topic == "none") continue;
    if (const auto taken = choice.further_scans.find(topic); taken != choice.further_scans.end())
      return Error{options.input.string() + ": --topics " + channel + "=" + topic + ": that topic is SCAN_" +
                   taken->second + " already; expected another topic for each channel"};
    const auto chosen = choose_topic(options, channel, candidates, kLaserScan);
    if (!chosen) return chosen.error();
    choice.further_scans[topic] = channel.substr(std::string(channel::kScan).size() + 1);
    std::erase(candidates, topic);
  }
  return {};
}

/// An ambiguous topic that was not requested is left out instead of refusing the bag.
Result<std::optional<std::string>> choose_extra(const ImportOptions& options, const std::string& channel,
                                                const std::vector<std::string>& candidates,
                                                const std::string& what) {
  if (candidates.size() > 1 && options.topics.count(channel) == 0) return std::optional<std::string>();
  return choose_topic(options, channel, candidates, what);
}

Result<std::optional<LaserDescription>> describe_laser(const ImportOptions& options, const BagSurvey& survey,
                                                       const std::string& base,
                                                       const std::optional<std::string>& topic,
                                                       std::vector<std::string>& notes) {
  if (!topic) return std::optional<LaserDescription>();
  const auto seen = survey.lasers.find(*topic);
  if (seen == survey.lasers.end()) {
    notes.push_back(*topic + ": no readable scan, so the description has no such laser");
    return std::optional<LaserDescription>();
  }
  LaserEvidence evidence = seen->second;
  bool moves = false;
  if (const auto pose = survey.frames.find(base, survey.topics.at(*topic).frame, moves)) {
    evidence.T_base_laser = Transform<Base, Laser>(*pose);
    evidence.height_known = true;
  }
  if (moves) {
    notes.push_back(*topic +
                    ": the laser moves on the robot; the pose of its first transform is used. If joints " +
                    "carry it, give the description a 'line_laser' with their 'head'");
  }
  auto described = evidence.describe(options, notes);
  if (!described) return described.error();
  return std::optional<LaserDescription>(std::move(*described));
}

template <class Description>
Result<std::optional<Description>> describe_camera(const BagSurvey& survey, const std::string& base,
                                                   const std::optional<std::string>& topic,
                                                   const std::optional<std::string>& info_topic,
                                                   std::vector<std::string>& notes) {
  if (!topic) return std::optional<Description>();
  if (!info_topic) {
    notes.push_back(*topic + ": no CameraInfo, so the description has no such camera");
    return std::optional<Description>();
  }
  const BagTopic& image_topic = survey.topics.at(*topic);
  const ros::CameraInfo& info = survey.cameras.at(*info_topic);
  const bool rectified = topic->find("rect") != std::string::npos;
  const auto pinhole = intrinsics(info, image_topic.width, image_topic.height, rectified);
  bool moves = false;
  const auto pose = survey.frames.find(base, image_topic.frame, moves);
  if (!pinhole || !pose) {
    notes.push_back(*topic + ": " +
                    (pinhole ? "no tf from " + base + " to " + image_topic.frame : pinhole.error().message) +
                    ", so the description has no such camera");
    return std::optional<Description>();
  }
  if (moves)
    notes.push_back(*topic + ": the camera moves on the robot; the pose of its first transform is used");
  Description description;
  description.intrinsics = *pinhole;
  description.T_base_optical = decltype(description.T_base_optical)(*pose);
  description.source = camera_info_text(*info_topic, info);
  return std::optional<Description>(std::move(description));
}

}  // namespace

bool is_tf(const std::string& type) { return type == "tf2_msgs/TFMessage" || type == "tf/tfMessage"; }

bool is_scan(const std::string& type) { return type == kLaserScan || type == kMultiEchoLaserScan; }

Result<ros::LaserScan> read_scan(const BagMessage& message) {
  return ros::read_laser_scan(message.bytes,
                              message.type == kMultiEchoLaserScan ? ros::Echoes::several : ros::Echoes::one);
}

Scan to_scan(const ros::LaserScan& message) {
  Scan scan{message.header.stamp,
            message.ranges,
            message.intensities,
            message.angle_min,
            message.angle_increment,
            {},
            {}};
  if (scan.intensities.size() != scan.ranges.size()) scan.intensities.clear();
  if (message.time_increment < 0 && !scan.ranges.empty()) {
    std::reverse(scan.ranges.begin(), scan.ranges.end());
    std::reverse(scan.intensities.begin(), scan.intensities.end());
    scan.angle_min += static_cast<float>(scan.ranges.size() - 1) * message.angle_increment;
    scan.angle_increment = -scan.angle_increment;
  }
  return scan;
}

void BagSurvey::take(const BagMessage& message) {
  BagTopic& topic = topics[message.topic];
  topic.type = message.type;
  const auto see = [&](const ros::Header& header) {
    if (topic.count++ == 0) topic.frame = header.frame;
    first_stamp.add(header.stamp.ns > 0 ? header.stamp : SensorTime{message.received.ns});
  };
  if (is_scan(message.type)) {
    const auto scan = read_scan(message);
    if (!scan) return;
    see(scan->header);
    LaserEvidence& evidence = lasers[message.topic];
    if (topic.count == 1) record_stated_values(message.topic, *scan, evidence);
    evidence.add(to_scan(*scan));
  } else if (is_tf(message.type)) {
    const auto transforms = ros::read_tf(message.bytes);
    if (!transforms) return;
    for (const ros::StampedTransform& transform : *transforms) {
      // Published once, maybe hours before the recording: its stamp is not of the recording's time.
      const bool is_static = is_static_tf(message.topic);
      if (!is_static) see(transform.header);
      frames.add(transform, is_static);
    }
  } else if (message.type == kString && message.topic.ends_with("robot_description") && urdf.empty()) {
    if (auto text = ros::read_string(message.bytes)) urdf = *std::move(text);
  } else if (message.type == kCameraInfo) {
    const auto info = ros::read_camera_info(message.bytes);
    if (!info) return;
    see(info->header);
    cameras.emplace(message.topic, *info);
  } else if (message.type == kOdometry) {
    const auto odom = ros::read_odometry(message.bytes);
    if (!odom) return;
    see(odom->header);
    odometry_child.emplace(message.topic, odom->child_frame);
  } else if (message.type == kImage && topic.count == 0) {
    const auto picture = ros::read_image(message.bytes);
    if (!picture) return;
    see(picture->header);
    topic.encoding = picture->encoding;
    topic.width = static_cast<int>(picture->width);
    topic.height = static_cast<int>(picture->height);
  } else if (message.type == kCompressedImage && topic.count == 0) {
    const auto picture = ros::read_compressed_image(message.bytes);
    if (!picture) return;
    see(picture->header);
    topic.encoding = picture->format;
    const auto decoded = is_depth_encoding(topic.encoding) ? to_depth(*picture) : to_colour(*picture);
    if (!decoded) return;
    topic.width = decoded->width;
    topic.height = decoded->height;
  } else if (message.type == kPoseStamped && topic.count == 0) {
    const auto pose = ros::read_pose_stamped(message.bytes);
    if (pose) see(pose->header);
  } else if (message.type == kImu && topic.count == 0) {
    const auto sample = ros::read_imu(message.bytes);
    if (sample) see(sample->header);
  }
}

std::vector<std::string> BagSurvey::of_type(const std::string& type) const {
  std::vector<std::string> found;
  for (const auto& [name, topic] : topics) {
    if (topic.type == type) found.push_back(name);
  }
  return found;
}

/// For at least two scans, none of which was given as SCAN.
std::string further_laser_hint(const ImportOptions& options, const std::vector<std::string>& scans) {
  std::string name = "SCAN_rear", given;
  for (int i = 2; options.topics.contains(name); ++i) name = "SCAN_" + std::to_string(i);
  for (const auto& [channel, topic] : options.topics) given += channel + "=" + topic + ",";
  return "\nA further laser becomes SCAN_<name>, as by --topics '" + given + "SCAN=" + scans[0] + "," + name +
         "=" + scans[1] + "'";
}

Result<BagChoice> choose_topics(const ImportOptions& options, const BagSurvey& survey) {
  BagChoice choice;
  const auto set = [](const Result<std::optional<std::string>>& from,
                      std::optional<std::string>& to) -> Status {
    if (!from) return from.error();
    to = *from;
    return {};
  };
  std::vector<std::string> scans = survey.of_type(kLaserScan);
  for (std::string& topic : survey.of_type(kMultiEchoLaserScan)) scans.push_back(std::move(topic));
  if (const Status further = choose_further_scans(options, scans, choice); !further) return further.error();
  const bool several = scans.size() > 1 && options.topics.count(channel::kScan) == 0;
  const auto lasers = choose_lasers(options, scans, kLaserScan);
  if (!lasers) return Error{lasers.error().message + (several ? further_laser_hint(options, scans) : "")};
  choice.scan = lasers->scan;
  choice.lines = lasers->lines;
  Status done = choose_odometry(options, survey, choice);
  if (done.ok())
    done = set(choose_topic(options, channel::kCamera, colour_topics(survey), "images"), choice.camera);
  if (done.ok())
    done = set(choose_topic(options, channel::kDepth, depth_topics(survey), "depth images"), choice.depth);
  if (done.ok() && choice.camera) {
    done = set(choose_topic(options, "CAMERA_INFO", infos_of(survey, *choice.camera), kCameraInfo),
               choice.camera_info);
  }
  if (done.ok() && choice.depth) {
    done = set(choose_topic(options, "DEPTH_INFO", infos_of(survey, *choice.depth), kCameraInfo),
               choice.depth_info);
  }
  if (done.ok()) done = set(choose_extra(options, channel::kImu, survey.of_type(kImu), kImu), choice.imu);
  if (done.ok()) {
    done = set(choose_extra(options, channel::kJointState, survey.of_type(kJointState), kJointState),
               choice.joints);
  }
  if (done.ok()) done = set(choose_reference(options, survey), choice.reference);
  // Commands are imported only on request: they may not come from a trainee.
  if (done.ok() && options.topics.count(channel::kTeleop) > 0) {
    std::vector<std::string> commands = survey.of_type(kTwist);
    for (std::string& stamped : survey.of_type(kTwistStamped)) commands.push_back(std::move(stamped));
    done = set(choose_topic(options, channel::kTeleop, commands, kTwist), choice.teleop);
  }
  if (!done.ok()) return done.error();
  return choice;
}

std::string base_frame(const BagSurvey& survey, const BagChoice& choice) {
  std::string base;
  if (choice.odometry_edge) {
    base = choice.odometry_edge->second;
  } else if (choice.odometry) {
    const auto child = survey.odometry_child.find(*choice.odometry);
    if (child != survey.odometry_child.end()) base = child->second;
  }
  for (const char* name : {"base_link", "base_footprint"}) {
    if (base.empty() && survey.frames.has(name)) base = name;
  }
  // On the floor straight below: the planar pose is the same, and heights are relative to the floor.
  bool moves = false;
  const auto below = survey.frames.find(base, "base_footprint", moves);
  const bool straight = below && !moves && below->translation().head<2>().norm() < 1e-3 &&
                        std::abs(Eigen::AngleAxisd(below->linear()).angle()) < 1e-3;
  return straight ? "base_footprint" : base;
}

Result<RobotDescription> describe(const ImportOptions& options, const BagSurvey& survey,
                                  const BagChoice& choice, std::vector<std::string>& notes) {
  const std::string base = base_frame(survey, choice);
  notes.push_back("base_link is the bag's frame '" + base + "'");
  std::vector<std::optional<std::string>> mounted = {choice.scan, choice.lines, choice.camera, choice.depth,
                                                     choice.imu};
  for (const auto& [topic, name] : choice.further_scans) mounted.emplace_back(topic);
  for (const auto& topic : mounted) {
    if (!topic) continue;
    for (std::string& note : survey.frames.contradictions(survey.topics.at(*topic).frame)) {
      if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(std::move(note));
    }
  }
  auto laser = describe_laser(options, survey, base, choice.scan, notes);
  if (!laser) return laser.error();
  auto lines = describe_laser(options, survey, base, choice.lines, notes);
  if (!lines) return lines.error();
  if (!choice.further_scans.empty() && !*laser)
    return Error{options.input.string() + ": --topics SCAN_" + choice.further_scans.begin()->second +
                 (choice.scan
                      ? ": SCAN=" + *choice.scan + " has no scan that can be read; give another as SCAN"
                      : std::string(": there is no first laser; give it as SCAN"))};
  RobotDescription robot = describe_robot(options, std::move(*laser), notes);
  for (const auto& [topic, name] : choice.further_scans) {
    auto further = describe_laser(options, survey, base, topic, notes);
    if (!further) return further.error();
    if (!*further) continue;  // describe_laser() has noted why
    robot.further_lasers.push_back({name, std::move(**further)});
    notes.push_back("SCAN_" + name + " is " + topic);
  }
  if (*lines) robot.line_laser = LineLaserDescription{std::move(**lines), {}};
  auto camera = describe_camera<CameraDescription>(survey, base, choice.camera, choice.camera_info, notes);
  auto depth = describe_camera<DepthCameraDescription>(survey, base, choice.depth, choice.depth_info, notes);
  if (!camera) return camera.error();
  if (!depth) return depth.error();
  robot.camera = std::move(*camera);
  robot.depth = std::move(*depth);
  if (choice.imu) {
    bool moves = false;
    const std::string& frame = survey.topics.at(*choice.imu).frame;
    if (const auto pose = survey.frames.find(base, frame, moves)) {
      robot.imu = ImuDescription{Transform<Base, Imu>(*pose)};
    } else {
      notes.push_back(*choice.imu + ": no tf from " + base + " to " + frame +
                      ", so its attitude is not used; give the description an 'imu' section");
    }
  }
  robot.source += "; " + joined(notes) + survey.frames.static_edges_text();
  for (const auto& [topic, info] : survey.cameras) {
    if (topic != choice.camera_info && topic != choice.depth_info)
      robot.source += "; " + camera_info_text(topic, info);
  }
  return robot;
}

}  // namespace parhelion::tools

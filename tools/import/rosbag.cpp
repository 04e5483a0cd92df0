// ROS recordings: LaserScan, Odometry or tf, Image and CompressedImage, CameraInfo, PoseStamped, Twist, Imu,
// JointState.
#include <cmath>
#include <functional>
#include <map>
#include <string>

#include "protocols/channels.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/recording_writer.hpp"
#include "tools/import/ros_camera.hpp"
#include "tools/import/rosbag_survey.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

template <class A, class B>
Transform<A, B> planar(const Eigen::Isometry3d& pose) {
  return Transform<A, B>::planar(pose.translation().x(), pose.translation().y(), Transform<A, B>(pose).yaw());
}

/// The recorder's receive time, if its clock is the sensors' own. A bag recorded from a replay has another
/// clock.
std::optional<ArrivalTime> arrival_of(const BagMessage& message, SensorTime stamp) {
  constexpr std::int64_t max_difference = 3'600'000'000'000;
  const std::int64_t apart = message.received.ns - stamp.ns;
  if (apart > max_difference || apart < -max_difference) return std::nullopt;
  return message.received;
}

class Copy {
 public:
  Copy(RecordingWriter& writer, const BagChoice& choice) : writer_(writer), choice_(choice) {}

  Status operator()(const BagMessage& message) {
    writer_.count_read();
    if (message.topic == choice_.scan) return put_scan(message, channel::kScan);
    if (message.topic == choice_.lines) return put_scan(message, channel::kLines);
    if (const auto further = choice_.further_scans.find(message.topic);
        further != choice_.further_scans.end())
      return put_scan(message, std::string(channel::kScan) + "_" + further->second);
    if (choice_.odometry_edge && is_tf(message.type)) return put_tf(message);
    if (message.topic == choice_.odometry) return put_odometry(message);
    if (message.topic == choice_.camera || message.topic == choice_.depth) return put_image(message);
    if (message.topic == choice_.reference) return put_reference(message);
    if (message.topic == choice_.teleop) return put_twist(message);
    if (message.topic == choice_.imu) return put_imu(message);
    if (message.topic == choice_.joints) return put_joints(message);
    // These go to the robot description.
    if (is_tf(message.type) || message.type == "sensor_msgs/CameraInfo") return {};
    writer_.leave_out(message.topic + " (" + message.type + ")");
    return {};
  }

  /// A driver that leaves the stamp at zero.
  void note_unstamped() const {
    for (const auto& [channel, count] : unstamped_) {
      writer_.note(
          channel + ": " + std::to_string(count) +
          " of its messages have no stamp in their header: they get " +
          "the time of recording, which is later than the measurement. Let the driver set header.stamp");
    }
  }

 private:
  template <class T>
  Status put(std::string_view channel, T item, const BagMessage& message) {
    const bool unstamped = item.stamp.ns <= 0;
    if (unstamped) {
      if (message.received.ns == 0)
        return refuse(message, Error{"neither its header nor the recording has a time for it"});
      item.stamp = {message.received.ns};
    }
    Status done = writer_.put(channel, item, message.number, arrival_of(message, item.stamp));
    if (done && unstamped) ++unstamped_[std::string(channel)];
    return done;
  }
  Status refuse(const BagMessage& message, const Error& error) {
    writer_.refuse(message.number, message.topic + ": " + error.message);
    return {};
  }

  Status put_scan(const BagMessage& message, std::string_view channel) {
    const auto scan = read_scan(message);
    if (!scan) return refuse(message, scan.error());
    return put(channel, to_scan(*scan), message);
  }

  Status put_odometry(const BagMessage& message) {
    const auto odometry = ros::read_odometry(message.bytes);
    if (!odometry) return refuse(message, odometry.error());
    return put(channel::kOdometry, Odometry{odometry->header.stamp, planar<Odom, Base>(odometry->pose)},
               message);
  }

  Status put_tf(const BagMessage& message) {
    const auto transforms = ros::read_tf(message.bytes);
    if (!transforms) return refuse(message, transforms.error());
    for (const ros::StampedTransform& transform : *transforms) {
      if (transform.header.frame != choice_.odometry_edge->first ||
          transform.child != choice_.odometry_edge->second) {
        continue;
      }
      // Some publishers repeat tf with the same stamp.
      const SensorTime stamp =
          transform.header.stamp.ns > 0 ? transform.header.stamp : SensorTime{message.received.ns};
      if (stamp == last_tf_) {
        writer_.leave_out("repeated tf");
        continue;
      }
      last_tf_ = stamp;
      const Odometry odometry{transform.header.stamp, planar<Odom, Base>(transform.pose)};
      if (Status done = put(channel::kOdometry, odometry, message); !done) return done;
    }
    return {};
  }

  Status put_image(const BagMessage& message) {
    const bool depth = message.topic == choice_.depth;
    Result<Image> image = Error{};
    if (message.type == "sensor_msgs/Image") {
      auto raw = ros::read_image(message.bytes);
      if (!raw) return refuse(message, raw.error());
      image = depth ? to_depth(*raw) : to_colour(std::move(*raw));
    } else {
      auto compressed = ros::read_compressed_image(message.bytes);
      if (!compressed) return refuse(message, compressed.error());
      image = depth ? to_depth(*compressed) : to_colour(std::move(*compressed));
    }
    if (!image) return refuse(message, image.error());
    return put(depth ? channel::kDepth : channel::kCamera, std::move(*image), message);
  }

  Status put_reference(const BagMessage& message) {
    const auto pose = ros::read_pose_stamped(message.bytes);
    if (!pose) return refuse(message, pose.error());
    PoseStamped reference;
    reference.stamp = pose->header.stamp;
    reference.T_map_base = Transform<Map, Base>(pose->pose);
    return put(channel::kReferencePose, reference, message);
  }

  Status put_twist(const BagMessage& message) {
    const bool stamped = message.type == "geometry_msgs/TwistStamped";
    const auto twist = stamped ? ros::read_twist_stamped(message.bytes) : ros::read_twist(message.bytes);
    if (!twist) return refuse(message, twist.error());
    return put(channel::kTeleop, TwistCommand{SensorTime{message.received.ns}, twist->twist}, message);
  }

  Status put_imu(const BagMessage& message) {
    const auto imu = ros::read_imu(message.bytes);
    if (!imu) return refuse(message, imu.error());
    return put(
        channel::kImu,
        ImuSample{imu->header.stamp, imu->orientation, imu->angular_velocity, imu->linear_acceleration},
        message);
  }

  Status put_joints(const BagMessage& message) {
    auto joints = ros::read_joint_state(message.bytes);
    if (!joints) return refuse(message, joints.error());
    return put(channel::kJointState,
               Joints{joints->header.stamp, std::move(joints->names), std::move(joints->positions),
                      std::move(joints->velocities), std::move(joints->efforts)},
               message);
  }

  RecordingWriter& writer_;
  const BagChoice& choice_;
  std::optional<SensorTime> last_tf_;
  std::map<std::string, std::size_t> unstamped_;  // by channel
};

/// Calls take(message) for each message, and damage(number, what) for unreadable parts. Stops at the first
/// error.
template <class Take, class Damage>
Status each_message(const ImportOptions& options, const ImportProgress& progress, double half, Take take,
                    Damage damage) {
  const auto opened = open_bag(options.input);
  if (!opened) return opened.error();
  BagSource& bag = **opened;
  BagMessage message;
  for (;;) {
    const auto more = bag.next(message);
    if (!more) {
      damage(bag.messages() + 1, more.error().message);
      continue;
    }
    if (!*more) return {};
    if (Status taken = take(message); !taken) return taken;
    if (progress && message.number % 64 == 0) progress(half * bag.total() + bag.done() / 2, bag.total());
  }
}

/// The URDF is a file of its own, as `robot new` takes it. Error: there is none, or it cannot be written.
Status check_urdf(const ImportOptions& options, const BagSurvey& survey, std::vector<std::string>& notes) {
  if (options.urdf.empty()) {
    if (!survey.urdf.empty())
      notes.emplace_back(
          "the recording has the robot's URDF: --urdf FILE writes it, for `parhelion robot new`");
    return {};
  }
  if (survey.urdf.empty())
    return Error{options.input.string() + ": no URDF on a topic robot_description (std_msgs/String)"};
  return check_writable(options.urdf, options.overwrite);
}

std::string list_topics(const BagSurvey& survey) {
  if (survey.topics.empty()) return " no message";
  std::string text;
  for (const auto& [name, topic] : survey.topics) text += "\n  " + name + " (" + topic.type + ")";
  return text;
}

/// What to do with topics of 3D lasers, which are not imported; empty: there is none.
std::string advice_for_clouds(const BagSurvey& survey) {
  std::string names;
  bool packets = false;
  for (const auto& [name, topic] : survey.topics) {
    const bool cloud = topic.type == "sensor_msgs/PointCloud2" || topic.type == "sensor_msgs/PointCloud";
    // Packets as a 3D laser sends them, such as velodyne_msgs/VelodyneScan.
    const bool packet =
        topic.type.ends_with("/VelodyneScan") || topic.type.find("/PacketMsg") != std::string::npos;
    if (cloud || packet) names += (names.empty() ? "" : ", ") + name;
    packets = packets || packet;
  }
  if (names.empty()) return {};
  return names + (packets ? ": clouds and packets of 3D lasers" : ": clouds") +
         " are not imported. For SCAN, make a LaserScan of them in ROS (pointcloud_to_laserscan) and record "
         "it; for a "
         "model of the site, write them as .pcd files (pcl_ros) for `parhelion map register`";
}

/// What the server or SLAM will lack.
void note_missing(const BagChoice& choice, std::vector<std::string>& notes) {
  if (!choice.scan)
    notes.emplace_back(
        "no SCAN: there is no sensor_msgs/LaserScan or MultiEchoLaserScan, so `slam`, `serve` and `replay` "
        "have no "
        "input");
  if (choice.scan && !choice.odometry)
    notes.emplace_back(
        "no ODOMETRY: there is neither nav_msgs/Odometry nor a tf from odom to the base; `slam "
        "--no-odometry` makes it of the scans");
}

}  // namespace

Result<ImportReport> import_rosbag(const ImportOptions& options, const ImportProgress& progress) {
  BagSurvey survey;
  const auto look = [&](const BagMessage& message) { return survey.take(message), Status{}; };
  std::string first_damage;
  const Status looked = each_message(options, progress, 0, look, [&](Place, const std::string& what) {
    if (first_damage.empty()) first_damage = what;
  });
  if (!looked) return looked.error();
  const auto choice = choose_topics(options, survey);
  if (!choice) return choice.error();
  const bool any = choice->scan || choice->lines || choice->camera || choice->depth || choice->odometry ||
                   choice->reference || !choice->further_scans.empty();
  const std::string clouds = advice_for_clouds(survey);
  if (!any || !survey.first_stamp.get()) {
    const std::string clouds_below = clouds.empty() ? "" : "\n" + clouds;
    return Error{options.input.string() +
                 ": no topic that could be imported: LaserScan, Odometry or tf, Image, "
                 "CompressedImage or PoseStamped is expected; " +
                 (first_damage.empty() ? "there is:" + list_topics(survey) : first_damage) + clouds_below};
  }
  std::vector<std::string> notes;
  const auto robot = describe(options, survey, *choice, notes);
  if (!robot) return robot.error();
  if (choice->reference) {
    notes.push_back("REFERENCE_POSE is " + *choice->reference + " in the bag's frame '" +
                    survey.topics.at(*choice->reference).frame + "'");
  }
  if (choice->odometry) notes.push_back("ODOMETRY is " + *choice->odometry);
  for (const std::string& topic : choice->unreadable_odometry)
    notes.push_back(topic + ": no message of it can be read, so it is not ODOMETRY");
  note_missing(*choice, notes);
  if (!clouds.empty()) notes.push_back(clouds);
  if (const Status possible = check_urdf(options, survey, notes); !possible) return possible.error();
  auto writer =
      RecordingWriter::create(options, options.input.filename().string() + ", message ", "messages");
  if (!writer) return writer.error();
  for (std::string& note : notes) writer->note(std::move(note));
  if (const Status written = writer->describe(*robot, *survey.first_stamp.get()); !written)
    return written.error();
  Copy copy(*writer, *choice);
  const Status copied =
      each_message(options, progress, 0.5, std::ref(copy),
                   [&](Place place, const std::string& what) { writer->refuse_damage(place, what); });
  if (!copied) return copied.error();
  copy.note_unstamped();
  auto finished = writer->finish();
  if (!finished || options.urdf.empty()) return finished;
  const Status written = write_text(options.urdf.string(), survey.urdf, options.overwrite);
  return written ? std::move(finished) : Result<ImportReport>(written.error());
}

}  // namespace parhelion::tools

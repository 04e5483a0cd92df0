#include "tools/import/ros_message.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace parhelion::tools::ros {
namespace {

static_assert(std::endian::native == std::endian::little,
              "ROS serializes little-endian; bytes are copied unchanged");

/// Of CDR: two bytes say which form, two are options.
constexpr std::size_t kCdrHeader = 4;
constexpr std::uint8_t kCdrLittleEndian = 1;
constexpr std::size_t kCovariance = 36, kTwist = 6;  ///< doubles
constexpr std::size_t kMaxCdrPadding = 3;            ///< behind a message, up to a multiple of 4

/// Consumes values from the front. After the first mismatch all values are zero, and its offset is kept.
class Cursor {
 public:
  explicit Cursor(MessageBytes message) : bytes_(message.bytes), cdr_(message.encoding == Encoding::cdr) {
    if (!cdr_) return;
    if (bytes_.size() < kCdrHeader || bytes_[0] != 0 || bytes_[1] != kCdrLittleEndian)
      fail("it does not begin as a message in little-endian CDR does");
    at_ = std::min(kCdrHeader, bytes_.size());
  }

  template <class T>
  T number() {
    align(sizeof(T));
    T value{};
    if (take(sizeof(T), "a number")) std::memcpy(&value, bytes_.data() + at_ - sizeof(T), sizeof(T));
    return value;
  }
  template <class T>
  std::vector<T> array() {
    const std::size_t n = number<std::uint32_t>();
    std::vector<T> values;
    if (n > 0) align(sizeof(T));
    if (ok() && n > (bytes_.size() - at_) / sizeof(T)) fail("an array of " + std::to_string(n) + " elements");
    if (!ok()) return values;
    values.resize(n);
    if (n > 0) std::memcpy(values.data(), bytes_.data() + at_, n * sizeof(T));
    at_ += n * sizeof(T);
    return values;
  }
  /// Of an array of arrays; `none` where one of these is empty.
  std::vector<float> first_of_each(float none) {
    std::vector<float> values;
    const std::size_t n = number<std::uint32_t>();
    for (std::size_t i = 0; i < n && ok(); ++i) {
      const std::vector<float> each = array<float>();
      values.push_back(each.empty() ? none : each.front());
    }
    return values;
  }
  template <std::size_t N>
  void numbers(double (&values)[N]) {
    for (double& value : values) value = number<double>();
  }
  std::string text() {
    auto letters = array<char>();
    if (cdr_ && !letters.empty()) letters.pop_back();  // the zero at its end
    return {letters.begin(), letters.end()};
  }
  void skip_doubles(std::size_t n) {
    align(sizeof(double));
    take(n * sizeof(double), "a fixed field");
  }

  Header header() {
    Header header;
    if (!cdr_) number<std::uint32_t>();
    // Signed in ROS 2.
    const std::int64_t seconds = cdr_ ? std::int64_t{number<std::int32_t>()} : number<std::uint32_t>();
    const std::int64_t ns = number<std::uint32_t>();
    header.stamp = {seconds * 1'000'000'000 + ns};
    header.frame = frame();
    return header;
  }
  std::string frame() {
    std::string name = text();
    if (name.starts_with("/")) name.erase(0, 1);
    return name;
  }
  Eigen::Isometry3d pose() {
    double p[3], q[4];
    numbers(p);
    numbers(q);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    const Eigen::Vector3d translation(p[0], p[1], p[2]);
    constexpr double tolerance = 0.01;
    if (!translation.allFinite() || !(std::abs(rotation.norm() - 1) < tolerance)) {
      fail("a pose that is not finite or whose quaternion is not of length 1");
      return pose;
    }
    pose.linear() = rotation.normalized().toRotationMatrix();
    pose.translation() = translation;
    return pose;
  }

  Twist twist() {
    double v[kTwist];
    numbers(v);
    return {{v[0], v[1], v[5]}};
  }

  bool ok() const { return error_.empty(); }
  template <class T>
  Result<T> done(T message) {
    const std::size_t padding = cdr_ ? kMaxCdrPadding : 0;
    if (ok() && bytes_.size() - at_ > padding)
      fail("the end, but there are " + std::to_string(bytes_.size()) + " bytes");
    if (!ok()) return Error{error_};
    return message;
  }

 private:
  /// In CDR a number lies at a multiple of its size from the header on.
  void align(std::size_t size) {
    if (cdr_ && ok()) at_ = std::min(at_ + (kCdrHeader + size - at_ % size) % size, bytes_.size());
  }
  bool take(std::size_t n, const char* what) {
    if (ok() && n > bytes_.size() - at_) fail(std::string(what) + " behind the end");
    if (ok()) at_ += n;
    return ok();
  }
  void fail(const std::string& what) {
    if (ok()) error_ = "byte " + std::to_string(at_) + " of the message: " + what;
  }

  std::span<const std::uint8_t> bytes_;
  bool cdr_;
  std::size_t at_ = 0;
  std::string error_;
};

}  // namespace

Result<std::string> read_string(MessageBytes bytes) {
  Cursor in(bytes);
  return in.done(in.text());
}

Result<LaserScan> read_laser_scan(MessageBytes bytes, Echoes echoes) {
  Cursor in(bytes);
  LaserScan scan;
  scan.header = in.header();
  for (float* value : {&scan.angle_min, &scan.angle_max, &scan.angle_increment, &scan.time_increment,
                       &scan.scan_time, &scan.range_min, &scan.range_max}) {
    *value = in.number<float>();
  }
  if (echoes == Echoes::one) {
    scan.ranges = in.array<float>();
    scan.intensities = in.array<float>();
  } else {
    scan.ranges = in.first_of_each(std::numeric_limits<float>::infinity());
    scan.intensities = in.first_of_each(0);
  }
  return in.done(std::move(scan));
}

Result<Image> read_image(MessageBytes bytes) {
  Cursor in(bytes);
  Image image;
  image.header = in.header();
  image.height = in.number<std::uint32_t>();
  image.width = in.number<std::uint32_t>();
  image.encoding = in.text();
  image.big_endian = in.number<std::uint8_t>() != 0;
  image.step = in.number<std::uint32_t>();
  image.data = in.array<std::uint8_t>();
  return in.done(std::move(image));
}

Result<CompressedImage> read_compressed_image(MessageBytes bytes) {
  Cursor in(bytes);
  CompressedImage image;
  image.header = in.header();
  image.format = in.text();
  image.data = in.array<std::uint8_t>();
  return in.done(std::move(image));
}

Result<CameraInfo> read_camera_info(MessageBytes bytes) {
  Cursor in(bytes);
  CameraInfo camera;
  camera.header = in.header();
  camera.height = in.number<std::uint32_t>();
  camera.width = in.number<std::uint32_t>();
  camera.distortion_model = in.text();
  camera.d = in.array<double>();
  in.numbers(camera.k);
  in.numbers(camera.r);
  in.numbers(camera.p);
  for (std::uint32_t* value : {&camera.binning_x, &camera.binning_y, &camera.roi_x, &camera.roi_y,
                               &camera.roi_height, &camera.roi_width}) {
    *value = in.number<std::uint32_t>();
  }
  camera.roi_rectify = in.number<std::uint8_t>() != 0;
  return in.done(std::move(camera));
}

Result<PoseStamped> read_pose_stamped(MessageBytes bytes) {
  Cursor in(bytes);
  PoseStamped pose;
  pose.header = in.header();
  pose.pose = in.pose();
  return in.done(std::move(pose));
}

Result<Odometry> read_odometry(MessageBytes bytes) {
  Cursor in(bytes);
  Odometry odometry;
  odometry.header = in.header();
  odometry.child_frame = in.frame();
  odometry.pose = in.pose();
  in.skip_doubles(kCovariance + kTwist + kCovariance);
  return in.done(std::move(odometry));
}

Result<std::vector<StampedTransform>> read_tf(MessageBytes bytes) {
  Cursor in(bytes);
  std::vector<StampedTransform> transforms;
  const auto n = in.number<std::uint32_t>();
  for (std::uint32_t i = 0; i < n && in.ok(); ++i) {
    StampedTransform& one = transforms.emplace_back();
    one.header = in.header();
    one.child = in.frame();
    one.pose = in.pose();
  }
  return in.done(std::move(transforms));
}

Result<Twist> read_twist(MessageBytes bytes) {
  Cursor in(bytes);
  return in.done(in.twist());
}

Result<Twist> read_twist_stamped(MessageBytes bytes) {
  Cursor in(bytes);
  in.header();
  return in.done(in.twist());
}

Result<Imu> read_imu(MessageBytes bytes) {
  Cursor in(bytes);
  Imu imu;
  imu.header = in.header();
  double q[4], covariance[9], v[3];
  in.numbers(q);
  in.numbers(covariance);
  // sensor_msgs/Imu: "if you have no estimate [of the orientation], set element 0 of its covariance to -1";
  // some leave the quaternion at zero instead.
  const Eigen::Quaterniond orientation(q[3], q[0], q[1], q[2]);
  if (covariance[0] != -1 && orientation.norm() != 0) imu.orientation = orientation;
  in.numbers(v);
  imu.angular_velocity = {v[0], v[1], v[2]};
  in.numbers(covariance);
  in.numbers(v);
  imu.linear_acceleration = {v[0], v[1], v[2]};
  in.numbers(covariance);
  return in.done(std::move(imu));
}

Result<JointState> read_joint_state(MessageBytes bytes) {
  Cursor in(bytes);
  JointState joints;
  joints.header = in.header();
  const auto n = in.number<std::uint32_t>();
  for (std::uint32_t i = 0; i < n && in.ok(); ++i) joints.names.push_back(in.text());
  joints.positions = in.array<double>();
  joints.velocities = in.array<double>();
  joints.efforts = in.array<double>();
  return in.done(std::move(joints));
}

}  // namespace parhelion::tools::ros

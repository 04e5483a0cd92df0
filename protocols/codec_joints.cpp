// imu_t, mbot_imu_t, joints_t.
#include <algorithm>
#include <numbers>

#include "parhelion/imu_t.hpp"
#include "parhelion/joints_t.hpp"
#include "parhelion/mbot_imu_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxJoints = 256;
constexpr std::size_t kMaxJointName = 64;
constexpr std::size_t kMinStringSize = 5;  // its length and its NUL

Eigen::Vector3d float_vector(wire::Reader& reader, const char* field) {
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v[i] = reader.bounded<float>(field, wire::kMaxRate);
  return v;
}

/// Yaw, pitch, roll in this order: R = Rz(yaw) Ry(pitch) Rx(roll), as in REP-103.
Eigen::Quaterniond from_roll_pitch_yaw(const Eigen::Vector3d& angles) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  return AngleAxisd(angles.z(), Vector3d::UnitZ()) * AngleAxisd(angles.y(), Vector3d::UnitY()) *
         AngleAxisd(angles.x(), Vector3d::UnitX());
}

Status decode_mbot(std::string_view channel, Bytes bytes, ImuSample& sample) {
  wire::Reader reader(channel, "mbot_imu_t", mbot_imu_t::getHash(), bytes);
  sample.stamp = reader.utime();
  sample.rotation_rate = float_vector(reader, "gyro") * (std::numbers::pi / 180);
  sample.acceleration = float_vector(reader, "accel");
  (void)float_vector(reader, "mag");
  sample.orientation = from_roll_pitch_yaw(float_vector(reader, "tb_angles"));
  (void)reader.bounded<float>("temp", wire::kMaxRate);
  return reader.status();
}

void check_joint_names(wire::Reader& reader, const std::vector<std::string>& names) {
  for (auto name = names.begin(); reader.ok() && name != names.end(); ++name) {
    reader.check(!name->empty() && name->size() <= kMaxJointName, "names", "a name that is empty or too long",
                 "1 to 64 bytes");
    reader.check(std::find(names.begin(), name, *name) == name, "names", "a duplicate joint name",
                 "each joint once");
  }
}

void read_values(wire::Reader& reader, const char* count_field, const char* field, std::size_t njoints,
                 std::vector<double>& values) {
  const std::size_t n = reader.count(count_field, sizeof(double), kMaxJoints);
  if (n != 0)
    reader.check_range(count_field, static_cast<std::int64_t>(n), static_cast<std::int64_t>(njoints),
                       static_cast<std::int64_t>(njoints));
  values.resize(reader.ok() ? n : 0);
  for (double& value : values) value = reader.bounded(field, wire::kMaxRate);
}

void write_values(wire::Writer& writer, const std::vector<double>& values) {
  writer.count(values.size());
  for (const double value : values) writer.number(value);
}

}  // namespace

Status decode(std::string_view channel, Bytes bytes, ImuSample& sample) {
  if (bytes.size() >= 8 && wire::big_endian<std::int64_t>(bytes.data()) == mbot_imu_t::getHash())
    return decode_mbot(channel, bytes, sample);
  wire::Reader reader(channel, "imu_t", imu_t::getHash(), bytes);
  sample.stamp = reader.utime();
  sample.orientation.reset();
  if (const std::size_t n = reader.count("norientation", sizeof(double), 4); n != 0) {
    reader.check_range("norientation", static_cast<std::int64_t>(n), 4, 4);
    sample.orientation = reader.orientation("orientation");
  }
  sample.rotation_rate = reader.vector("rotation_rate", wire::kMaxRate);
  sample.acceleration = reader.vector("accel", wire::kMaxRate);
  return reader.status();
}

void encode(const ImuSample& sample, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(imu_t::getHash(), bytes);
  writer.number(sample.stamp.utime());
  writer.count(sample.orientation ? 4 : 0);
  if (sample.orientation) writer.orientation(*sample.orientation);
  writer.vector(sample.rotation_rate);
  writer.vector(sample.acceleration);
}

Status decode(std::string_view channel, Bytes bytes, Joints& joints) {
  wire::Reader reader(channel, "joints_t", joints_t::getHash(), bytes);
  joints.stamp = reader.utime();
  const std::size_t n = reader.count("njoints", kMinStringSize, kMaxJoints);
  reader.check_range("njoints", static_cast<std::int64_t>(n), 1, static_cast<std::int64_t>(kMaxJoints));
  joints.names.resize(n);
  for (std::string& name : joints.names) reader.text("names", name);
  check_joint_names(reader, joints.names);
  read_values(reader, "npositions", "positions", n, joints.positions);
  read_values(reader, "nvelocities", "velocities", n, joints.velocities);
  read_values(reader, "nefforts", "efforts", n, joints.efforts);
  return reader.status();
}

void encode(const Joints& joints, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(joints_t::getHash(), bytes);
  writer.number(joints.stamp.utime());
  writer.count(joints.names.size());
  for (const std::string& name : joints.names) writer.text(name);
  write_values(writer, joints.positions);
  write_values(writer, joints.velocities);
  write_values(writer, joints.efforts);
}

}  // namespace parhelion

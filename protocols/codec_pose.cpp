// pose_cov_t, pose_t, pose2D_t, twist2D_t, mbot_motor_command_t.
#include "parhelion/mbot_motor_command_t.hpp"
#include "parhelion/pose2D_t.hpp"
#include "parhelion/pose_cov_t.hpp"
#include "parhelion/pose_t.hpp"
#include "parhelion/twist2D_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr double kMaxTheta = 1e6;  // rad: odometry that never wraps

void read_covariance(wire::Reader& reader, PoseCovariance& covariance) {
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) covariance(row, column) = reader.bounded("covariance", 1e16);
  }
  const double asymmetry = (covariance - covariance.transpose()).cwiseAbs().maxCoeff();
  if (asymmetry > 1e-6 * covariance.cwiseAbs().maxCoeff()) {
    reader.fail_value("covariance", asymmetry, "a symmetric matrix (this is the largest difference)");
  }
  if (const double smallest = covariance.diagonal().minCoeff(); smallest < 0) {
    reader.fail_value("covariance", smallest, "variances that are not negative");
  }
}

}  // namespace

Status decode(std::string_view channel, Bytes bytes, PoseEstimate& estimate) {
  wire::Reader reader(channel, "pose_cov_t", pose_cov_t::getHash(), bytes);
  estimate.stamp = reader.utime();
  const Eigen::Vector3d position = reader.vector("pos", wire::kMaxPosition);
  estimate.T_map_base = {reader.orientation("orientation"), position};
  read_covariance(reader, estimate.covariance);
  reader.name("map_id", estimate.map_id);
  estimate.state = reader.enumeration("state", SlamState::unsure);
  estimate.step_time = nanoseconds(reader.number<std::int64_t>("step_ns"));
  reader.check_range("step_ns", estimate.step_time.ns, 0, INT64_MAX);
  estimate.causal = reader.boolean("causal");
  return reader.status();
}

void encode(const PoseEstimate& estimate, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(pose_cov_t::getHash(), bytes);
  writer.number(estimate.stamp.utime());
  writer.vector(estimate.T_map_base.translation());
  writer.orientation(estimate.T_map_base.quaternion());
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) writer.number(estimate.covariance(row, column));
  }
  writer.text(estimate.map_id);
  writer.enumeration(estimate.state);
  writer.number(estimate.step_time.ns);
  writer.boolean(estimate.causal);
}

Status decode(std::string_view channel, Bytes bytes, PoseStamped& pose) {
  wire::Reader reader(channel, "pose_t", pose_t::getHash(), bytes);
  pose.stamp = reader.utime();
  const Eigen::Vector3d position = reader.vector("pos", wire::kMaxPosition);
  pose.velocity = reader.vector("vel", wire::kMaxRate);
  pose.T_map_base = {reader.orientation("orientation"), position};
  pose.rotation_rate = reader.vector("rotation_rate", wire::kMaxRate);
  pose.acceleration = reader.vector("accel", wire::kMaxRate);
  return reader.status();
}

void encode(const PoseStamped& pose, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(pose_t::getHash(), bytes);
  writer.number(pose.stamp.utime());
  writer.vector(pose.T_map_base.translation());
  writer.vector(pose.velocity);
  writer.orientation(pose.T_map_base.quaternion());
  writer.vector(pose.rotation_rate);
  writer.vector(pose.acceleration);
}

Status decode(std::string_view channel, Bytes bytes, Odometry& odometry) {
  wire::Reader reader(channel, "pose2D_t", pose2D_t::getHash(), bytes);
  odometry.stamp = reader.utime();
  const double x = reader.bounded<float>("x", wire::kMaxPosition);
  const double y = reader.bounded<float>("y", wire::kMaxPosition);
  const double theta = reader.bounded<float>("theta", kMaxTheta);
  Status status = reader.status();
  if (status.ok()) odometry.T_odom_base = Transform<Odom, Base>::planar(x, y, theta);
  return status;
}

void encode(const Odometry& odometry, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(pose2D_t::getHash(), bytes);
  writer.number(odometry.stamp.utime());
  writer.number(static_cast<float>(odometry.T_odom_base.translation().x()));
  writer.number(static_cast<float>(odometry.T_odom_base.translation().y()));
  writer.number(static_cast<float>(odometry.T_odom_base.yaw()));
}

namespace {

bool is_motor_command(Bytes bytes) {
  return bytes.size() >= sizeof(std::int64_t) &&
         wire::big_endian<std::int64_t>(bytes.data()) == mbot_motor_command_t::getHash();
}

Status decode_motor_command(std::string_view channel, Bytes bytes, TwistCommand& command) {
  wire::Reader reader(channel, "mbot_motor_command_t", mbot_motor_command_t::getHash(), bytes);
  command.type = CommandType::mbot_motor;
  command.stamp = reader.utime();
  command.twist.vx = reader.bounded<float>("trans_v", wire::kMaxRate);
  command.twist.vy = 0;
  command.twist.wz = reader.bounded<float>("angular_v", wire::kMaxRate);
  return reader.status();
}

void encode_motor_command(const TwistCommand& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(mbot_motor_command_t::getHash(), bytes);
  writer.number(command.stamp.utime());
  writer.number(static_cast<float>(command.twist.vx));
  writer.number(static_cast<float>(command.twist.wz));
}

}  // namespace

Status decode(std::string_view channel, Bytes bytes, TwistCommand& command) {
  if (is_motor_command(bytes)) return decode_motor_command(channel, bytes, command);
  command.type = CommandType::twist;
  wire::Reader reader(channel, "twist2D_t", twist2D_t::getHash(), bytes);
  command.stamp = reader.utime();
  command.twist.vx = reader.bounded<float>("vx", wire::kMaxRate);
  command.twist.vy = reader.bounded<float>("vy", wire::kMaxRate);
  command.twist.wz = reader.bounded<float>("wz", wire::kMaxRate);
  return reader.status();
}

void encode(const TwistCommand& command, std::vector<std::uint8_t>& bytes) {
  if (command.type == CommandType::mbot_motor) return encode_motor_command(command, bytes);
  wire::Writer writer(twist2D_t::getHash(), bytes);
  writer.number(command.stamp.utime());
  writer.number(static_cast<float>(command.twist.vx));
  writer.number(static_cast<float>(command.twist.vy));
  writer.number(static_cast<float>(command.twist.wz));
}

}  // namespace parhelion

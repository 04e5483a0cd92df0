#include "fusion/pose/joint_track.hpp"

#include <algorithm>

namespace parhelion {
namespace {

constexpr std::size_t slots = 2048;  // two seconds at 1 kHz
constexpr Duration clock_restart = seconds(2.0);

}  // namespace

JointTrack::JointTrack(const std::vector<std::vector<HeadJoint>>& heads) {
  for (const auto& head : heads) {
    for (const HeadJoint& joint : head) {
      const bool known = std::any_of(joints_.begin(), joints_.end(),
                                     [&](const Followed& other) { return other.name == joint.joint; });
      if (!known) joints_.push_back({joint.joint, Ring<Sample>(slots)});
    }
  }
}

void JointTrack::add(const Joints& joints) {
  if (joints.positions.empty()) return;
  for (Followed& followed : joints_) {
    const auto name = std::find(joints.names.begin(), joints.names.end(), followed.name);
    if (name == joints.names.end()) continue;
    Ring<Sample>& samples = followed.samples;
    if (samples.count() > 0 && joints.stamp <= samples.newest().stamp) {
      if (samples.newest().stamp - joints.stamp <= clock_restart) continue;
      samples.clear();
    }
    samples.push({joints.stamp, joints.positions[static_cast<std::size_t>(name - joints.names.begin())]});
  }
}

std::optional<double> JointTrack::at(const std::string& joint, SensorTime t) const {
  const auto followed =
      std::find_if(joints_.begin(), joints_.end(), [&](const Followed& each) { return each.name == joint; });
  if (followed == joints_.end()) return std::nullopt;
  const Ring<Sample>& samples = followed->samples;
  const std::size_t age = samples.age_at(t);
  if (age == samples.count()) return std::nullopt;
  const Sample& before = samples.newest(age);
  if (age == 0) {
    if (t - before.stamp > longest_gap) return std::nullopt;
    return before.position;
  }
  const Sample& after = samples.newest(age - 1);
  if (after.stamp - before.stamp > longest_gap) return std::nullopt;
  const double s = (t - before.stamp).seconds() / (after.stamp - before.stamp).seconds();
  return before.position + s * (after.position - before.position);
}

Result<Eigen::Isometry3d> head_turn(const std::vector<HeadJoint>& head, const JointTrack& joints,
                                    SensorTime t) {
  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
  for (const HeadJoint& joint : head) {
    const auto angle = joints.at(joint.joint, t);
    if (!angle) return Error{"the encoder of joint '" + joint.joint + "' is silent or too old"};
    turn = turn * Eigen::Translation3d(joint.point) * Eigen::AngleAxisd(*angle, joint.axis) *
           Eigen::Translation3d(-joint.point);
  }
  return turn;
}

}  // namespace parhelion

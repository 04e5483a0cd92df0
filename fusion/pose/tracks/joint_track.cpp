#include "fusion/pose/tracks/joint_track.hpp"

#include <algorithm>

#include "fusion/pose/tracks/bracket.hpp"

namespace parhelion::pose {
namespace {

constexpr std::size_t kSlots = 2048;  // two seconds at 1 kHz

}  // namespace

JointTrack::JointTrack(const std::vector<std::vector<HeadJoint>>& heads) {
  for (const auto& head : heads) {
    for (const HeadJoint& joint : head) {
      const bool known = std::any_of(joints_.begin(), joints_.end(),
                                     [&](const Followed& other) { return other.name == joint.joint; });
      if (!known) joints_.push_back({joint.joint, Ring<Sample>(kSlots)});
    }
  }
}

void JointTrack::add(const Joints& joints) {
  if (joints.positions.empty()) return;
  for (Followed& followed : joints_) {
    const auto name = std::find(joints.names.begin(), joints.names.end(), followed.name);
    if (name == joints.names.end()) continue;
    const double position = joints.positions[static_cast<std::size_t>(name - joints.names.begin())];
    push_in_order({joints.stamp, position}, followed.samples);
  }
}

std::optional<double> JointTrack::at(const std::string& joint, SensorTime t) const {
  const auto followed =
      std::find_if(joints_.begin(), joints_.end(), [&](const Followed& each) { return each.name == joint; });
  if (followed == joints_.end()) return std::nullopt;
  const auto found = bracket(followed->samples, t, kLongestGap);
  if (!found) return std::nullopt;
  return found->before->position + found->s * (found->after->position - found->before->position);
}

bool JointTrack::reaches(const std::string& joint, SensorTime t) const {
  return std::any_of(joints_.begin(), joints_.end(), [&](const Followed& each) {
    return each.name == joint && each.samples.count() > 0 && each.samples.newest().stamp >= t;
  });
}

Result<Transform<Base, Base>> head_turn(const std::vector<HeadJoint>& head, const JointTrack& joints,
                                        SensorTime t) {
  return head_turn(head, [&](const std::string& joint) { return joints.at(joint, t); });
}

Result<Transform<Base, Base>> head_turn(const std::vector<HeadJoint>& head, const JointPosition& position) {
  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
  for (const HeadJoint& joint : head) {
    const auto angle = position(joint.joint);
    if (!angle) return Error{"the encoder of joint '" + joint.joint + "' is silent or too old"};
    turn = turn * Eigen::Translation3d(joint.point) * Eigen::AngleAxisd(*angle, joint.axis) *
           Eigen::Translation3d(-joint.point);
  }
  return Transform<Base, Base>(turn);
}

}  // namespace parhelion::pose

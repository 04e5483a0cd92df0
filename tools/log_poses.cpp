#include "tools/log_poses.hpp"

#include <algorithm>
#include <utility>

#include "fusion/pose/tracks/joint_track.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tools {

bool LogPoses::handle(const Message& event) {
  if (event.channel == channel::kPoseCov) {
    PoseEstimate estimate;
    if (!decode(event.channel, event.payload, estimate)) return false;
    if (estimate.state == SlamState::tracking && estimate.T_map_base.finite())
      estimates_.add(estimate.stamp, estimate.T_map_base);
  } else if (event.channel == channel::kPose) {
    PoseStamped pose;
    if (!decode(event.channel, event.payload, pose)) return false;
    if (pose.T_map_base.finite()) poses_.add(pose.stamp, pose.T_map_base);
  } else if (event.channel == channel::kJointState) {
    Joints joints;
    if (!decode(event.channel, event.payload, joints)) return false;
    for (std::size_t i = 0; i < std::min(joints.names.size(), joints.positions.size()); ++i)
      joints_[joints.names[i]].add(joints.stamp, joints.positions[i]);
  }
  return true;
}

void LogPoses::finish() {
  if (!estimates_.empty()) poses_ = std::move(estimates_);
  poses_.sort();
  for (auto& [name, track] : joints_) track.sort();
}

std::optional<Transform<Map, Base>> LogPoses::base_at(SensorTime t) const {
  return poses_.at(t, [](const auto& a, const auto& b, double s) { return interpolate(a, b, s); });
}

Result<Transform<Base, Base>> LogPoses::turn_at(const std::vector<HeadJoint>& head, SensorTime t) const {
  return pose::head_turn(head, [&](const std::string& joint) -> std::optional<double> {
    const auto track = joints_.find(joint);
    if (track == joints_.end()) return std::nullopt;
    return track->second.at(t, [](double a, double b, double s) { return a + s * (b - a); });
  });
}

}  // namespace parhelion::tools

// Positions of the joints that carry a camera, at any instant, from the encoders.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/tracks/ring.hpp"
#include "protocols/joints.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// Fixed-size histories; adding never allocates. Only the joints of the given heads are kept.
class JointTrack {
 public:
  /// Tracks the joints of these heads.
  explicit JointTrack(const std::vector<std::vector<HeadJoint>>& heads);

  /// A message may contain only some of the joints: several drivers may share the channel.
  void add(const Joints& joints);
  /// Interpolated between two samples at most `kLongestGap` apart, or at most that long after the newest.
  std::optional<double> at(const std::string& joint, SensorTime t) const;

  /// Whether the joint has a sample at t or later, so that at() interpolates.
  bool reaches(const std::string& joint, SensorTime t) const;

  static constexpr Duration kLongestGap = milliseconds(200);

 private:
  struct Sample {
    SensorTime stamp;
    double position = 0;
  };
  struct Followed {
    std::string name;
    Ring<Sample> samples;
  };
  std::vector<Followed> joints_;
};

/// The motion of a sensor carried by a head: T_base_sensor = turn * T_base_sensor(all joints at zero), a
/// product of exponentials (Lynch and Park, Modern Robotics, section 4.1.1). Error: a joint's encoder has
/// sent no message, or its last one is too old; the text names the joint.
Result<Transform<Base, Base>> head_turn(const std::vector<HeadJoint>& head, const JointTrack& joints,
                                        SensorTime t);
/// The same for joint positions (rad) from another source.
using JointPosition = std::function<std::optional<double>(const std::string& joint)>;
Result<Transform<Base, Base>> head_turn(const std::vector<HeadJoint>& head, const JointPosition& position);

}  // namespace parhelion::pose

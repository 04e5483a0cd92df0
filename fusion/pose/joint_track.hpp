// Positions of the joints that carry a camera, at any instant, from the encoders.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/ring.hpp"
#include "protocols/joints.hpp"
#include "protocols/robot.hpp"

namespace parhelion::pose {

/// Fixed-size histories; adding never allocates. Joints that were not asked for are not kept.
class JointTrack {
 public:
  /// Follows the joints of these heads.
  explicit JointTrack(const std::vector<std::vector<HeadJoint>>& heads);

  /// A message may speak of some joints only: several drivers may share the channel.
  void add(const Joints& joints);
  /// Between two samples at most `longest_gap` apart, or at most that after the newest.
  std::optional<double> at(const std::string& joint, SensorTime t) const;

  /// Whether the joint's encoder has spoken of t or later: at() is then no guess about what is to come.
  bool reaches(const std::string& joint, SensorTime t) const;

  static constexpr Duration longest_gap = milliseconds(200);

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

/// How the head has turned what it carries: T_base_sensor = turn * T_base_sensor(all joints at zero), a
/// product of exponentials (Lynch and Park, Modern Robotics, section 4.1.1). Error: the encoders of a joint
/// are silent or too old; the text says which.
Result<Transform<Base, Base>> head_turn(const std::vector<HeadJoint>& head, const JointTrack& joints,
                                        SensorTime t);
/// The same for joints whose positions (rad) come from elsewhere.
using JointPosition = std::function<std::optional<double>(const std::string& joint)>;
Result<Transform<Base, Base>> head_turn(const std::vector<HeadJoint>& head, const JointPosition& position);

}  // namespace parhelion::pose

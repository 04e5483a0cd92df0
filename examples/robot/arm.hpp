// An arm with encoders and a gripper: obeys MR_JOINT_CMD within its limits, and holds its posture when no
// command comes. body.urdf describes the same arm to Parhelion.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "geometry.hpp"
#include "parhelion/joints_t.hpp"

namespace robot {

constexpr double kTurretHeight = 0.6, kShoulderHeight = 0.66;      // m over the floor, above base_link
constexpr double kUpperArm = 0.36, kForearm = 0.32, kHand = 0.14;  // m; the hand: wrist to between the pads
constexpr double kFingerTravel = 0.05;                             // m, of each finger

// Positions of its joints, rad; of each finger m.
struct ArmPosture {
  double turret = 0, shoulder = 0, elbow = 0, wrist = 0, gripper = 0;
};
constexpr ArmPosture kFolded{0, 1.5708, -2.4958, -0.6109, 0};

// The hand level, with the point between its pads `reach` m from the turret's axis and z m over the floor;
// none: out of reach.
std::optional<ArmPosture> reach_for(double reach, double z, double turret, double gripper);

class Arm {
 public:
  static constexpr std::int64_t kSilence = 300'000;  // us without a command: hold

  Arm();
  // Joints that it does not have are ignored, as are values that are not finite.
  void receive(const parhelion::joints_t& command, std::int64_t now);
  void step(double dt, std::int64_t now);
  // What the encoders read.
  parhelion::joints_t state(std::int64_t utime) const;
  ArmPosture posture() const;

 private:
  struct Joint {
    std::string name;
    double lower, upper, max_speed;  // rad or m, and per s
    double resolution;               // of its encoder
    double position = 0, speed = 0;
    bool to_target = false;  // else by `wanted_speed`
    double target = 0, wanted_speed = 0;
  };
  std::vector<Joint> joints_;
  std::int64_t received_ = -kSilence;
};

}  // namespace robot

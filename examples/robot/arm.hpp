// An arm with encoders: obeys MR_JOINT_CMD within its limits, and holds still when it is silent.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "parhelion/joints_t.hpp"

namespace robot {

class Arm {
 public:
  static constexpr std::int64_t kSilence = 300'000;  // us without a command: hold

  Arm();
  // Joints that it does not have are ignored, as are values that are not finite.
  void receive(const parhelion::joints_t& command, std::int64_t now);
  void step(double dt, std::int64_t now);
  // What the encoders read.
  parhelion::joints_t state(std::int64_t utime) const;

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

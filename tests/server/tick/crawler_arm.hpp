// Inverse kinematics of the shipped crawler's arm.
#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <string>

namespace parhelion::test {

/// m, of the model: upper arm, forearm, from the wrist to the point between the pads, height of the shoulder
/// over base_link, and how far in front of it the turret's axis is.
inline constexpr double kUpperArm = 0.46, kForearm = 0.40, kHand = 0.1875, kShoulder = 0.355, kTurret = 0.12;

/// Joint positions for the point between the pads at `ahead` m from the turret's axis and height z over
/// base_link, fingers down.
inline std::map<std::string, double> crawler_reach(double ahead, double z, double turned = 0) {
  const double dz = z + kHand - kShoulder, d2 = ahead * ahead + dz * dz;
  const double elbow =
      -std::acos((d2 - kUpperArm * kUpperArm - kForearm * kForearm) / (2 * kUpperArm * kForearm));
  const double shoulder =
      std::atan2(dz, ahead) +
      std::acos((d2 + kUpperArm * kUpperArm - kForearm * kForearm) / (2 * kUpperArm * std::sqrt(d2)));
  return {{"turret_joint", turned},
          {"shoulder_joint", shoulder},
          {"elbow_joint", elbow},
          {"wrist_joint", -std::numbers::pi / 2 - shoulder - elbow}};
}

}  // namespace parhelion::test

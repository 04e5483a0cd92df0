#include "server/simulation/bodies/gait.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::simulation {
namespace {

constexpr double kLift = 0.09;       // m, ankle of the swinging foot above its standing height
constexpr double kArmSwing = 0.45;   // rad
constexpr double kStandBend = 0.02;  // m, knees are never completely straight

Transform<Base, Body> pitched(double pitch, const Eigen::Vector3d& p_base) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY())), p_base};
}

struct AnklePlace {
  double x = 0;  // m, forward of the hip
  double z = 0;  // m, over the floor
};

/// For half of the phase the foot stands and so moves back relative to the body, at the body's speed; in the
/// other half it swings forward.
AnklePlace ankle(double phase, double amplitude, double stride) {
  const double turn = phase / (2 * std::numbers::pi);
  const double part = turn - std::floor(turn);
  const double reach = amplitude * stride / 4;
  if (part < 0.5) return {reach * (1 - 4 * part), kPerson.ankle};
  const double swing = 2 * part - 1;
  return {-reach * std::cos(std::numbers::pi * swing),
          kPerson.ankle + amplitude * kLift * std::sin(std::numbers::pi * swing)};
}

/// Two-link inverse kinematics in the leg's plane, knee forward.
void leg_poses(double hip_z, double y, const AnklePlace& at, std::vector<Transform<Base, Body>>& poses) {
  const double dx = at.x, dz = hip_z - at.z;
  const double thigh = kPerson.thigh, shank = kPerson.shank;
  const double reach = std::min(std::hypot(dx, dz), thigh + shank);
  const double along = std::atan2(dx, dz);  // angle of the line from hip to ankle, forward from vertical
  const double at_hip =
      std::acos(std::clamp((thigh * thigh + reach * reach - shank * shank) / (2 * thigh * reach), -1.0, 1.0));
  const double thigh_angle = along + at_hip;
  const Eigen::Vector3d hip(0, y, hip_z);
  const Eigen::Vector3d knee =
      hip + thigh * Eigen::Vector3d(std::sin(thigh_angle), 0, -std::cos(thigh_angle));
  const Eigen::Vector3d foot(at.x, y, at.z);
  const double shank_angle = std::atan2(foot.x() - knee.x(), knee.z() - foot.z());
  // A limb hangs along -z of its frame: forward is a rotation about -y.
  poses.push_back(pitched(-thigh_angle, hip));
  poses.push_back(pitched(-shank_angle, knee));
  poses.push_back(pitched(0, foot));
}

}  // namespace

void gait_poses(double phase, double amplitude, double stride, std::vector<Transform<Base, Body>>& poses) {
  const AnklePlace left = ankle(phase, amplitude, stride);
  const AnklePlace right = ankle(phase + std::numbers::pi, amplitude, stride);
  // The more stretched leg limits the hip's height: it sinks when the feet are apart.
  const double leg = kPerson.thigh + kPerson.shank - kStandBend;
  const auto highest = [leg](const AnklePlace& at) { return at.z + std::sqrt(leg * leg - at.x * at.x); };
  const double hip_z = std::min(highest(left), highest(right));
  const double sunk = leg + kPerson.ankle - hip_z;

  const double swing = amplitude * kArmSwing * std::cos(phase);
  const double shoulder = kPerson.shoulder_height - sunk;
  poses.push_back(pitched(0, {0, 0, -sunk}));
  poses.push_back(pitched(swing, {0, kPerson.shoulder_half_width, shoulder}));
  poses.push_back(pitched(-swing, {0, -kPerson.shoulder_half_width, shoulder}));
  leg_poses(hip_z, kPerson.hip_half_width, left, poses);
  leg_poses(hip_z, -kPerson.hip_half_width, right, poses);
}

}  // namespace parhelion::simulation

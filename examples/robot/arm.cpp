#include "arm.hpp"

#include <algorithm>
#include <cmath>

namespace robot {

std::optional<ArmPosture> reach_for(double reach, double z, double turret, double gripper) {
  const double dx = reach - kHand, dz = z - kShoulderHeight;
  const double d2 = dx * dx + dz * dz, d = std::sqrt(d2);
  if (d >= kUpperArm + kForearm || d <= kUpperArm - kForearm) return std::nullopt;
  ArmPosture posture{turret, 0, 0, 0, gripper};
  posture.elbow = -std::acos((d2 - kUpperArm * kUpperArm - kForearm * kForearm) / (2 * kUpperArm * kForearm));
  posture.shoulder = std::atan2(dz, dx) +
                     std::acos((d2 + kUpperArm * kUpperArm - kForearm * kForearm) / (2 * kUpperArm * d));
  posture.wrist = -posture.shoulder - posture.elbow;
  return posture;
}

Arm::Arm()
    : joints_{{"turret", -2.8, 2.8, 1.0, 0.0015, kFolded.turret},
              {"shoulder", -1.2, 1.6, 0.8, 0.0015, kFolded.shoulder},
              {"elbow", -2.5, 0.2, 1.0, 0.0015, kFolded.elbow},
              {"wrist", -2.0, 2.4, 1.2, 0.0015, kFolded.wrist},
              {"gripper", 0, kFingerTravel, 0.06, 0.0001, kFolded.gripper}} {}

void Arm::receive(const parhelion::joints_t& command, std::int64_t now) {
  received_ = now;
  for (std::size_t i = 0; i < command.names.size(); ++i) {
    for (Joint& joint : joints_) {
      if (joint.name != command.names[i]) continue;
      joint.to_target = i < command.positions.size() && std::isfinite(command.positions[i]);
      if (joint.to_target) joint.target = std::clamp(command.positions[i], joint.lower, joint.upper);
      const bool has_speed = i < command.velocities.size() && std::isfinite(command.velocities[i]);
      joint.wanted_speed =
          has_speed ? std::clamp(command.velocities[i], -joint.max_speed, joint.max_speed) : 0;
    }
  }
}

void Arm::step(double dt, std::int64_t now) {
  const bool silent = now - received_ > kSilence;
  for (Joint& joint : joints_) {
    const double wanted = joint.to_target ? (joint.target - joint.position) / dt : joint.wanted_speed;
    joint.speed = silent ? 0 : std::clamp(wanted, -joint.max_speed, joint.max_speed);
    joint.position = std::clamp(joint.position + joint.speed * dt, joint.lower, joint.upper);
  }
}

parhelion::joints_t Arm::state(std::int64_t utime) const {
  parhelion::joints_t state{};
  state.utime = utime;
  for (const Joint& joint : joints_) {
    state.names.push_back(joint.name);
    state.positions.push_back(std::round(joint.position / joint.resolution) * joint.resolution);
    state.velocities.push_back(joint.speed);
  }
  state.njoints = state.npositions = state.nvelocities = static_cast<std::int32_t>(joints_.size());
  return state;
}

ArmPosture Arm::posture() const {
  return {joints_[0].position, joints_[1].position, joints_[2].position, joints_[3].position,
          joints_[4].position};
}

}  // namespace robot

// Drives with a fault in their odometry or their laser, made from good ones. Severity is random, by a seed.
#pragma once

#include <algorithm>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "fusion/pose/odometry/odometry_comparison.hpp"
#include "fusion/pose/odometry/odometry_sanity.hpp"
#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"
#include "protocols/scan.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::test {

/// A scan, or a sample of odometry.
struct DriveInput {
  std::optional<Scan> scan;
  Odometry odometry;
};

/// In the order of arrival: odometry before the scans with later stamps.
inline std::vector<DriveInput> inputs_of(const TrueDrive& drive) {
  std::vector<DriveInput> inputs;
  auto odometry = drive.odometry.begin();
  for (const TrueScan& at : drive.scans) {
    for (; odometry != drive.odometry.end() && odometry->stamp <= at.scan.stamp; ++odometry)
      inputs.push_back({{}, *odometry});
    inputs.push_back({at.scan, {}});
  }
  return inputs;
}

enum class Corruption {
  rotation_flipped,
  translation_flipped,
  reversed,
  frozen,
  scaled_up,
  scaled_down,
  wheel_dead,
  wheel_doubled,
  spinning,  ///< wheels that turn more than the robot moves
  delayed,
  stamps_frozen,
  stamps_jumped,
  silent,
  laser_backward,     ///< from the start
  laser_upside_down,  ///< from the start
  laser_frozen,
};
constexpr int kCorruptions = 16;

struct CorruptionKind {
  const char* name;
  bool from_the_start;
  bool scans_suffice;  ///< the map is to be as good as without the fault
  std::vector<pose::OdometryFault> right_names;
};

inline const CorruptionKind& kind_of(Corruption corruption) {
  using Fault = pose::OdometryFault;
  static const CorruptionKind kinds[kCorruptions] = {
      {"rotation_flipped", false, true, {Fault::rotation_reversed}},
      {"translation_flipped", false, true, {Fault::translation_reversed}},
      {"reversed", false, true, {Fault::reversed, Fault::translation_reversed}},
      {"frozen", false, true, {Fault::frozen}},
      {"scaled_up", false, true, {Fault::scale}},
      {"scaled_down", false, true, {Fault::scale}},
      {"wheel_dead", false, true, {Fault::wheel}},
      {"wheel_doubled", false, true, {Fault::wheel}},
      {"spinning", false, true, {Fault::slipping, Fault::scale, Fault::inconsistent}},
      {"delayed", false, true, {Fault::delayed}},
      {"stamps_frozen", false, true, {Fault::stamps_frozen}},
      {"stamps_jumped", false, true, {Fault::stamps_jumped}},
      {"silent", false, true, {Fault::silent}},
      {"laser_backward", true, false, {Fault::translation_reversed}},
      {"laser_upside_down", true, false, {Fault::rotation_reversed}},
      {"laser_frozen", false, false, {Fault::laser_frozen}},
  };
  return kinds[static_cast<int>(corruption)];
}

/// What odometry with this fault reports instead of a step in `dt` s.
class CorruptedSteps {
 public:
  CorruptedSteps(Corruption corruption, std::mt19937& random) : corruption_(corruption) {
    std::uniform_real_distribution<double> unit(0, 1);
    factor_ = corruption == Corruption::scaled_down ? 0.4 + 0.3 * unit(random) : 1.5 + unit(random);
    right_ = unit(random) < 0.5;
    width_ = 0.3 + 0.4 * unit(random);
    spin_ = 0.4 + 0.6 * unit(random);
  }

  Twist2 operator()(Twist2 step, double dt) const {
    switch (corruption_) {
      case Corruption::rotation_flipped:
        return {step.vx, step.vy, -step.wz};
      case Corruption::translation_flipped:
        return {-step.vx, -step.vy, step.wz};
      case Corruption::reversed:
        return {-step.vx, -step.vy, -step.wz};
      case Corruption::frozen:
        return {};
      case Corruption::scaled_up:
      case Corruption::scaled_down:
        return {factor_ * step.vx, factor_ * step.vy, factor_ * step.wz};
      case Corruption::wheel_dead:
        return with_wheel(step, 0);
      case Corruption::wheel_doubled:
        return with_wheel(step, 2);
      case Corruption::spinning:
        return {step.vx + spin_ * dt, step.vy, step.wz};
      default:
        return step;
    }
  }

 private:
  Twist2 with_wheel(const Twist2& step, double factor) const {
    double left = step.vx - step.wz * width_ / 2, right = step.vx + step.wz * width_ / 2;
    (right_ ? right : left) *= factor;
    return {(left + right) / 2, step.vy, (right - left) / width_};
  }

  Corruption corruption_;
  double factor_ = 1, width_ = 0.5, spin_ = 0;
  bool right_ = false;
};

/// `onset`: stamp of the first scan with the fault.
struct CorruptedDrive {
  std::vector<DriveInput> inputs;
  SensorTime onset;
};

/// From `fraction` of the inputs on; kinds that are there from the start: from the first.
inline CorruptedDrive corrupted(const std::vector<DriveInput>& inputs, Corruption corruption, double fraction,
                                std::uint32_t seed) {
  std::mt19937 random(seed);
  const CorruptedSteps steps(corruption, random);
  std::uniform_real_distribution<double> unit(0, 1);
  const Duration delay = parhelion::seconds(0.3 + 0.25 * unit(random));
  const Duration jump = parhelion::seconds((unit(random) < 0.5 ? -1 : 1) * (5 + 100 * unit(random)));
  const bool whole = kind_of(corruption).from_the_start;
  const std::size_t first =
      whole ? 0 : static_cast<std::size_t>(fraction * static_cast<double>(inputs.size()));
  CorruptedDrive result;
  std::optional<Odometry> last, last_before;
  std::optional<Scan> last_scan;
  Pose2 odom;
  bool begun = false;
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    DriveInput input = inputs[i];
    const bool on = i >= first;
    if (input.scan) {
      if (on && !begun) result.onset = input.scan->stamp, begun = true;
      Scan& scan = *input.scan;
      if (corruption == Corruption::laser_backward) scan.angle_min -= std::numbers::pi_v<float>;
      if (corruption == Corruption::laser_upside_down) {
        std::reverse(scan.ranges.begin(), scan.ranges.end());
        scan.angle_min =
            -(scan.angle_min + static_cast<float>(scan.ranges.size() - 1) * scan.angle_increment);
      }
      if (corruption == Corruption::laser_frozen && on && last_scan) scan.ranges = last_scan->ranges;
      last_scan = scan;
      result.inputs.push_back(std::move(input));
      continue;
    }
    const Odometry original = input.odometry;
    if (last) {
      const Pose2 step = planar(last->T_odom_base).inverse() * planar(original.T_odom_base);
      const double dt = std::clamp((original.stamp - last->stamp).seconds(), 0.0, 0.5);
      odom = odom * moved(on ? steps(twist_to(step), dt) : twist_to(step), 1);
    }
    last = original;
    input.odometry.T_odom_base = transform<Odom, Base>(odom);
    if (on && corruption == Corruption::silent) continue;
    if (on && corruption == Corruption::delayed) input.odometry.stamp = original.stamp + delay;
    if (on && corruption == Corruption::stamps_jumped) input.odometry.stamp = original.stamp + jump;
    if (on && corruption == Corruption::stamps_frozen && last_before)
      input.odometry.stamp = last_before->stamp;
    if (!on) last_before = original;
    result.inputs.push_back(std::move(input));
  }
  return result;
}

}  // namespace parhelion::test

// In which order a laser measures the beams of a message. Many small lasers turn clockwise, and their drivers
// sort the beams by angle: the last one is measured first. Scans that are corrected in the wrong order are
// bent, by twice what the robot turns during a sweep, and so is a map that is made of them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "fusion/pose/matching/sweep_motion.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

/// Compares scans of a robot that turns with one from before the turn, each corrected in the described order
/// and in reverse: the true order makes them fit better. How fast the robot turns is seen from each scan to
/// the next, so odometry may be late or wrong, but must not stand still. Nothing is concluded from a laser
/// whose whole sweep takes less than 40 ms, or from scans that have times of their own. Deterministic; does
/// nothing once it has concluded, after 60 comparisons, or after 2,000 scans of a robot that moves.
class BeamOrder {
 public:
  enum class Verdict : std::uint8_t { unknown, as_described, reversed };

  explicit BeamOrder(const LaserDescription& laser);

  /// The next scan. `step`: of the base since the previous one by odometry, as a start for matches, and to
  /// save them where it stands; nullopt: unknown. Returns the verdict.
  Verdict add(const Scan& scan, const std::optional<Pose2>& step);
  Verdict verdict() const { return verdict_; }
  int comparisons() const { return comparisons_; }

 private:
  struct View {
    Scan scan;
    SweepMotion sweep;
    Pose2 T_local_base;  ///< by matches from scan to scan
  };
  std::optional<Twist2> follow(const Scan& scan, const std::optional<Pose2>& step);
  void compare(const View& view);
  std::optional<double> preference(const View& view) const;
  double turn_during(const SweepMotion& sweep) const { return sweep.twist.wz * sweep_seconds_; }
  void conclude();

  LaserDescription described_, reversed_, at_once_;
  double sweep_seconds_ = 0;
  std::optional<Scan> newest_;
  std::optional<Twist2> before_newest_;  ///< from the scan before it
  Pose2 T_local_newest_;
  std::optional<View> first_;  ///< before the turn
  Verdict verdict_ = Verdict::unknown;
  int followed_ = 0;  ///< scans
  int comparisons_ = 0, for_reversed_ = 0;
  double sum_ = 0;  ///< of the preferences; positive: for reversed
};

/// The same of recorded scans, without odometry.
BeamOrder beam_order_of(std::span<const Scan> scans, const LaserDescription& laser);

}  // namespace parhelion::pose

// In which order a laser measures the beams of a message, or whether it measures them at once. Many small
// lasers turn clockwise, and their drivers sort the beams by angle: the last one is measured first. Other
// drivers say nothing of the beams' times. Scans that are corrected in the wrong order are bent, by up to
// twice what the robot turns during a sweep, and so is a map that is made of them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "fusion/pose/matching/sweep_motion.hpp"
#include "protocols/pose2.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

/// Compares scans of a robot that turns with one from before the turn, each corrected for a sweep from the
/// first beam to the last, for one from the last to the first, and for none: the true order makes them fit
/// best. The sweep takes as long as it is described to; where the description has the beams at once, as long
/// as a laser needs that turns once a scan. How fast the robot turns is seen from each scan to the next, so
/// odometry may be late or wrong, but must not stand still. Nothing is concluded from a laser whose whole
/// sweep takes less than 40 ms, or from scans that have times of their own. Deterministic; does nothing once
/// it has concluded, after 60 comparisons, or after 2,000 scans of a robot that moves (20,000 where no
/// odometry tells that it stands).
class BeamOrder {
 public:
  enum class Verdict : std::uint8_t {
    unknown,
    as_described,
    reversed,
    at_once,  ///< a sweep is described, but there is none
    swept,    ///< the description has the beams at once
  };

  explicit BeamOrder(const LaserDescription& laser);

  /// The next scan. `step`: of the base since the previous one by odometry, as a start for matches, and to
  /// save them where it stands; nullopt: unknown. Returns the verdict.
  Verdict add(const Scan& scan, const std::optional<Pose2>& step);
  Verdict verdict() const { return verdict_; }
  /// Further scans change nothing.
  bool done() const;
  /// Scans have shown another order than the described one.
  bool differs() const { return verdict_ != Verdict::unknown && verdict_ != Verdict::as_described; }
  /// s, as scans show it, negative where the last beam is measured first; as described before a verdict.
  double beam_interval() const { return shown_.beam_interval; }
  /// Gives the laser the beams' times that scans show.
  void correct(LaserDescription& laser) const;
  /// Where the order differs: how the beams are measured, and how many scans were compared.
  std::string what() const;
  /// The same, and what to write.
  std::string advice() const;
  int comparisons() const { return comparisons_; }

 private:
  struct View {
    Scan scan;
    SweepMotion sweep;
    Pose2 T_local_base;  ///< by matches from scan to scan
  };
  /// Of two orders, over all comparisons.
  struct Rivals {
    int second_better = 0;
    double sum = 0;  ///< of the differences of costs; positive: the second fits better
    void add(double first_cost, double second_cost);
    bool second_wins(int comparisons) const;
    bool first_wins(int comparisons) const;
  };
  std::optional<Twist2> follow(const Scan& scan, const std::optional<Pose2>& step);
  void compare(const View& view);
  double turn_during(const SweepMotion& sweep) const { return sweep.twist.wz * sweep_seconds_; }
  void conclude();

  bool describe_orders(const Scan& scan);

  LaserDescription described_, shown_;
  std::optional<LaserDescription> at_once_, forward_, backward_;  ///< none: before the first scan
  double sweep_seconds_ = 0;
  std::optional<Scan> newest_;
  std::optional<Twist2> before_newest_;  ///< from the scan before it
  Pose2 T_local_newest_;
  std::optional<View> first_;  ///< before the turn
  Verdict verdict_ = Verdict::unknown;
  int followed_ = 0, moved_ = 0;  ///< scans
  int comparisons_ = 0;
  Rivals forward_backward_, forward_at_once_, backward_at_once_;
};

/// The same of recorded scans, without odometry.
BeamOrder beam_order_of(std::span<const Scan> scans, const LaserDescription& laser);

}  // namespace parhelion::pose

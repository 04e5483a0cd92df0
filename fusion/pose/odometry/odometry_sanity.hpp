// Watches odometry while SLAM runs: its stamps, and its motion against the one that matched scans show.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/odometry/odometry_comparison.hpp"
#include "fusion/pose/tracks/odometry_track.hpp"
#include "fusion/pose/tracks/ring.hpp"
#include "protocols/pose.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

struct OdometryFinding {
  OdometryFault fault = OdometryFault::none;
  SensorTime since;                 ///< stamp of the scan at which it was noticed first
  std::optional<SensorTime> until;  ///< stamp of the scan at which it was over; none: it lasts
  std::string text;                 ///< what it is, with figures, and what to do
};

/// The motion since the previous scan, in the frame of its base.
struct ScanStep {
  SensorTime stamp;
  double seconds = 0;  ///< by the stamps, which may be wrong
  Pose2 odometry;      ///< as it is used for this scan
  bool odometry_known = true;
  Pose2 scans;                                     ///< as scans alone show it
  bool position_known = false, yaw_known = false;  ///< the points determine it, without any prior
  bool repeated = false;                           ///< the scan is the previous one, bit by bit
};

/// Deterministic. A fault is named once several windows in a row show it, and is over once they show none.
class OdometrySanity {
 public:
  /// `exists`: false where the robot has no odometry, which is no finding.
  explicit OdometrySanity(bool exists = true);

  /// In the order of arrival, before the scans that arrive later.
  void add(const Odometry& odometry);
  void add(const ScanStep& step);

  /// Scans match nothing any more: they are no evidence against odometry.
  void give_up(SensorTime now);
  /// Odometry stands still while scans turn: names that at once, if nothing else is wrong.
  void froze(SensorTime now);
  /// The robot was picked up: a finding that lasts until it has been found again.
  void picked_up(SensorTime now);
  void found_again(SensorTime now);

  /// What is wrong now.
  OdometryFault fault() const { return fault_; }
  /// Odometry is reversed and never was right, as it seems if the laser is mounted backward or upside down.
  bool is_mounting_doubtful() const;
  /// The last comparison showed a fault, named yet or not.
  bool is_suspected() const {
    return fault_ != OdometryFault::none || (agreeing_ > 0 && suspected_.fault != OdometryFault::none);
  }
  /// Everything that was found, in the order of time.
  const std::vector<OdometryFinding>& findings() const { return findings_; }

 private:
  struct Verdict {
    OdometryFault fault = OdometryFault::none;
    std::string figures;
    bool by_clock = false;                         ///< by stamps and arrivals, not by motion
    bool position_shown = true, yaw_shown = true;  ///< the robot moved enough to tell
  };
  struct Arrivals {
    int count = 0;        ///< samples since the last scan
    int same_stamp = 0;   ///< samples in a row with another pose and the stamp of the one before
    double usual = 0;     ///< s from a scan's stamp to the newest odometry at its arrival, of sane scans
    int learned = 0;      ///< scans that `usual` comes from, at most
    int off = 0;          ///< scans in a row with another value
    double period = 0.1;  ///< s between samples
  };
  std::size_t scans_within(double window) const;
  std::vector<MotionPair> pairs(double window) const;
  std::vector<MotionPair> pairs_at(double window, double offset) const;
  std::optional<Verdict> by_stamps(SensorTime scan);
  std::optional<Verdict> by_motion() const;
  std::optional<Verdict> at_another_instant(double window, double contradiction) const;
  bool laser_repeats(double window) const;
  int enough_of(const Verdict& verdict) const;
  bool may_end(const Verdict& verdict) const;
  void end_finding(SensorTime now);
  OdometryFault with_what_is_hidden(const Verdict& verdict) const;
  void settle(std::optional<Verdict> verdict, SensorTime now);

  OdometryTrack track_;
  Ring<ScanStep> steps_;
  std::optional<Odometry> latest_;
  Arrivals arrivals_;
  std::optional<SensorTime> last_news_;              ///< stamp of the scan before which odometry last arrived
  double since_judged_ = 0;                          ///< s since motions were last compared
  OdometryFault usual_fault_ = OdometryFault::none;  ///< `silent` where there is no odometry
  OdometryFault fault_ = OdometryFault::none;
  bool agreed_along_ = false, agreed_turning_ = false;  ///< odometry and scans, at some time
  Verdict suspected_;
  int agreeing_ = 0;  ///< verdicts in a row like `suspected_`
  SensorTime suspected_since_;
  std::vector<OdometryFinding> findings_;
  std::optional<std::size_t> lasting_;  ///< the finding that lasts
};

}  // namespace parhelion::pose

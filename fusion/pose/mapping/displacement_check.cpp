#include "fusion/pose/mapping/displacement_check.hpp"

#include <algorithm>

#include "fusion/pose/matching/scan_change.hpp"

namespace parhelion::pose {
namespace {

/// Sum of what vanished and what appeared, where the map explains little, and where it explains as much as it
/// does among people. Chosen on generated drives: robots put down in offices, rooms and halls on one hand,
/// people, doors, fast turns and a scan a second on the other.
constexpr double kContradicted = 0.2, kAllContradicted = 0.7;
/// People around a robot appear in front of what stands, and little vanishes. Chosen on fr-clinic (0.02).
constexpr double kVanished = 0.05;
/// If all that has changed is that something vanished, people have left, or the laser has passed something
/// close to it.
constexpr double kAppeared = 0.01;
/// s: from a scan to the next, and usually; and the longest that is learned from. In a longer time people
/// change much: chosen on fr-clinic, with a scan in 0.7 s.
constexpr double kNextScan = 0.5, kLongest = 1, kIntervalMemory = 0.1;
constexpr double kLittleExplained = 0.75;  ///< of what is usual
constexpr double kUsualMemory = 0.02;      ///< weight of a scan in that

}  // namespace

void DisplacementCheck::add(const ScanPoints& keyframe, const ScanPoints& scan,
                            const Motions& T_keyframe_base, double explained) {
  const bool little = scans_ > 0 && explained < kLittleExplained * usual_;
  const double enough = little ? kContradicted : kAllContradicted;
  const double since = before_ ? std::min((scan.stamp - *before_).seconds(), kLongest) : kLongest;
  before_ = scan.stamp;
  interval_ += kIntervalMemory * (since - interval_);
  const bool soon = since < kNextScan && interval_ < kNextScan;
  suspected_ = false;
  double vanished = 0;
  if (soon) {
    const ScanChange tracked = change_between(keyframe, scan, T_keyframe_base.tracked);
    if (tracked.exceeds(enough) && tracked.appeared > kAppeared) {
      const ScanChange predicted = change_between(keyframe, scan, T_keyframe_base.predicted);
      suspected_ = predicted.exceeds(enough);
      vanished = std::min(tracked.vanished, predicted.vanished);
    }
  }
  contradictions_ = suspected_ && vanished > kVanished ? contradictions_ + 1 : 0;
  if (suspected_) return;
  usual_ += std::max(kUsualMemory, 1.0 / ++scans_) * (explained - usual_);
}

}  // namespace parhelion::pose

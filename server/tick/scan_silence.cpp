#include "server/tick/scan_silence.hpp"

#include <algorithm>

namespace parhelion::tick {
namespace {

constexpr double kMinSilence = 1;  // s; twice what suspends the injection, so that a short gap stops nobody
constexpr double kPeriods = 3;     // two lost scans in a row do not stop a slow laser
constexpr double kLearned = 0.1;   // of the difference, per scan
constexpr int kFirst = 10;         // intervals of which the longest counts: the description may be wrong
constexpr double kLongest = 2;     // s, of these
constexpr int kFewest = 2;         // intervals that say what is usual

}  // namespace

ScanSilence::ScanSilence(const RobotDescription& robot)
    : period_(robot.laser ? robot.laser->scan_period : 0) {}

void ScanSilence::add(SimulationTime arrival) {
  if (last_) {
    const double since = (arrival - *last_).seconds();
    // A silence is no period.
    if (intervals_ < kFirst)
      period_ = std::max(period_, std::min(since, kLongest));
    else
      period_ += kLearned * (std::min(since, std::max(kMinSilence, kPeriods * period_)) - period_);
    ++intervals_;
  }
  last_ = arrival;
}

bool ScanSilence::silent(SimulationTime now) const {
  return intervals_ >= kFewest && (now - *last_).seconds() > std::max(kMinSilence, kPeriods * period_);
}

}  // namespace parhelion::tick

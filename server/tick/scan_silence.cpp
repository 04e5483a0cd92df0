#include "server/tick/scan_silence.hpp"

#include <algorithm>

namespace parhelion::tick {
namespace {

constexpr double kMinSilence = 1;  // s; twice what suspends the injection, so that a short gap stops nobody
constexpr double kPeriods = 3;     // two lost scans in a row do not stop a slow laser
constexpr double kLearned = 0.1;   // of the difference, per scan

}  // namespace

ScanSilence::ScanSilence(const RobotDescription& robot)
    : period_(robot.laser ? robot.laser->scan_period : 0) {}

void ScanSilence::add(SimulationTime arrival) {
  if (last_) {
    const double since = (arrival - *last_).seconds();
    // A silence is no period.
    period_ = period_ > 0 ? period_ + kLearned * (std::min(since, kPeriods * period_) - period_) : since;
  }
  last_ = arrival;
}

bool ScanSilence::silent(SimulationTime now) const {
  return last_ && (now - *last_).seconds() > std::max(kMinSilence, kPeriods * period_);
}

}  // namespace parhelion::tick

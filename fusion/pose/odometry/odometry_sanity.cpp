#include "fusion/pose/odometry/odometry_sanity.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace parhelion::pose {
namespace {

constexpr std::size_t kSteps = 1024;     ///< scans that are remembered
constexpr double kHistory = 12;          ///< s
constexpr double kGap = 0.5;             ///< s without odometry over which its motion still counts as known
constexpr double kPair = 0.2;            ///< s
constexpr double kWindows[] = {4, 8};    ///< s; the first in which the robot moves enough decides
constexpr double kJudgeEvery = 0.25;     ///< s
constexpr int kConfirmations = 3;        ///< verdicts in a row that name a fault
constexpr int kMotionConfirmations = 6;  ///< the same for faults that only motion shows
/// The same for `inconsistent`, which every onset seems to be at first, and for `delayed`, which explains
/// many a contradiction for a while.
constexpr int kLastResort = 24;
constexpr int kClearances = 8;            ///< verdicts in a row that end one
constexpr double kLargestOffset = 0.6;    ///< s
constexpr double kOffsetStep = 0.05;      ///< s
constexpr double kSmallestOffset = 0.15;  ///< s; smaller ones are for `calibrate`
constexpr double kJump = 0.25;            ///< s
constexpr double kAnotherClock = 2;       ///< s; odometry that is so far from the scans is of no use for them
constexpr double kSilence = 1;            ///< s
constexpr int kSameStamps = 5;            ///< samples
constexpr int kLearned = 50;              ///< scans

/// Stamps may stand still or jump back.
double plausible(double seconds) { return std::clamp(seconds, 0.0, 0.5); }

/// A wrong sign or factor, which more motion shows better.
bool is_systematic(OdometryFault fault) {
  return fault == OdometryFault::reversed || fault == OdometryFault::translation_reversed ||
         fault == OdometryFault::rotation_reversed || fault == OdometryFault::wheel ||
         fault == OdometryFault::scale;
}

Eigen::Vector3d vector_of(const Pose2& motion) {
  const Twist2 twist = twist_to(motion);
  return {twist.vx, twist.vy, twist.wz};
}

std::string seconds_text(const char* format, double value) {
  char text[120];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace

OdometrySanity::OdometrySanity(bool exists)
    : track_(seconds(kHistory), seconds(kGap)),
      steps_(kSteps),
      usual_fault_(exists ? OdometryFault::none : OdometryFault::silent),
      fault_(usual_fault_) {}

void OdometrySanity::add(const Odometry& odometry) {
  if (!planar(odometry.T_odom_base).finite()) return;
  ++arrivals_.count;
  if (latest_ && odometry.stamp == latest_->stamp) {
    const Pose2 step = planar(latest_->T_odom_base).inverse() * planar(odometry.T_odom_base);
    if (step.position().norm() > 1e-9 || std::abs(step.yaw) > 1e-9) ++arrivals_.same_stamp;
  } else {
    if (latest_ && odometry.stamp > latest_->stamp) {
      const double period = (odometry.stamp - latest_->stamp).seconds();
      arrivals_.period += 0.05 * (std::min(period, 1.0) - arrivals_.period);
    }
    arrivals_.same_stamp = 0;
  }
  latest_ = odometry;
  track_.add(odometry);
}

void OdometrySanity::add(const ScanStep& step) {
  if (usual_fault_ != OdometryFault::none) return;
  steps_.push(step);
  const auto stamps = by_stamps(step.stamp);
  since_judged_ += plausible(step.seconds);
  if (!stamps && since_judged_ < kJudgeEvery) return;
  since_judged_ = 0;
  settle(stamps ? stamps : by_motion(), step.stamp);
}

std::optional<OdometrySanity::Verdict> OdometrySanity::by_stamps(SensorTime scan) {
  const bool arrived = arrivals_.count > 0;
  arrivals_.count = 0;
  if (arrivals_.same_stamp >= kSameStamps)
    return Verdict{OdometryFault::stamps_frozen,
                   std::to_string(arrivals_.same_stamp) + " poses with one stamp", true};
  if (arrived || !last_news_) last_news_ = scan;
  const double silence = (scan - *last_news_).seconds();
  if (silence > std::max(kSilence, 5 * arrivals_.period))
    return Verdict{OdometryFault::silent, seconds_text("for %.1f s", silence), true};
  if (!arrived || !latest_) return std::nullopt;
  const double ahead = (latest_->stamp - scan).seconds(), off = ahead - arrivals_.usual;
  if (arrivals_.learned == 0) arrivals_.usual = ahead;
  if (arrivals_.learned > 5 && std::abs(off) > std::max(kJump, 1.5 * arrivals_.period)) {
    if (++arrivals_.off < kSameStamps) return std::nullopt;
    return Verdict{std::abs(off) > kLargestOffset ? OdometryFault::stamps_jumped : OdometryFault::delayed,
                   seconds_text("its stamps moved by %+.2f s against those of the scans", off), true};
  }
  if (std::abs(ahead) > kAnotherClock) {
    return Verdict{OdometryFault::stamps_jumped,
                   seconds_text("its stamps are %+.1f s from those of the scans", ahead), true};
  }
  arrivals_.off = 0;
  arrivals_.learned = std::min(arrivals_.learned + 1, kLearned);
  arrivals_.usual += (ahead - arrivals_.usual) / arrivals_.learned;
  return std::nullopt;
}

/// The number of newest scans.
std::size_t OdometrySanity::scans_within(double window) const {
  std::size_t count = 0;
  for (double elapsed = 0; count < steps_.count() && elapsed < window; ++count)
    elapsed += plausible(steps_.newest(count).seconds);
  return count;
}

std::vector<MotionPair> OdometrySanity::pairs(double window) const {
  std::vector<MotionPair> result;
  MotionPair pair;
  Pose2 odometry, scans;
  bool known = true;
  const auto begin = [&] {
    pair.seconds = 0;
    pair.position_known = pair.yaw_known = known = true;
    odometry = scans = {};
  };
  begin();
  for (std::size_t age = scans_within(window); age-- > 0;) {
    const ScanStep& step = steps_.newest(age);
    pair.seconds += plausible(step.seconds);
    odometry = odometry * step.odometry;
    scans = scans * step.scans;
    known &= step.odometry_known;
    pair.position_known &= step.position_known;
    pair.yaw_known &= step.yaw_known;
    if (pair.seconds < kPair) continue;
    pair.odometry = vector_of(odometry);
    pair.scans = vector_of(scans);
    if (known) result.push_back(pair);
    begin();
  }
  return result;
}

/// The same with odometry of other instants; nothing where the scans' stamps are not in order.
std::vector<MotionPair> OdometrySanity::pairs_at(double window, double offset) const {
  std::vector<MotionPair> result;
  MotionPair pair;
  Pose2 scans;
  const auto begin = [&] {
    pair.seconds = 0;
    pair.position_known = pair.yaw_known = true;
    scans = {};
  };
  begin();
  for (std::size_t age = scans_within(window); age-- > 0;) {
    const ScanStep& step = steps_.newest(age);
    if (step.seconds <= 0) return {};
    pair.seconds += step.seconds;
    scans = scans * step.scans;
    pair.position_known &= step.position_known;
    pair.yaw_known &= step.yaw_known;
    if (pair.seconds < kPair) continue;
    const auto before = track_.at(step.stamp + seconds(offset - pair.seconds));
    const auto after = track_.at(step.stamp + seconds(offset));
    if (before && after && after->ahead == 0) {
      pair.odometry = vector_of(before->T_odom_base.inverse() * after->T_odom_base);
      pair.scans = vector_of(scans);
      result.push_back(pair);
    }
    begin();
  }
  return result;
}

std::optional<OdometrySanity::Verdict> OdometrySanity::by_motion() const {
  std::optional<Verdict> agreement;
  for (const double window : kWindows) {
    const MotionComparison comparison = compare(pairs(window));
    const auto fault = fault_of(comparison);
    if (!fault) continue;
    if (*fault == OdometryFault::none) {
      // The longer window may still show a systematic error: slow turns that go the wrong way.
      if (!agreement)
        agreement = Verdict{*fault, comparison.figures(), false, comparison.position_excited(),
                            comparison.yaw_excited()};
      continue;
    }
    if (agreement && !is_systematic(*fault)) continue;
    if (*fault == OdometryFault::slipping && laser_repeats(window))
      return Verdict{OdometryFault::laser_frozen, comparison.figures()};
    const bool may_be_late = *fault == OdometryFault::inconsistent || *fault == OdometryFault::scale ||
                             *fault == OdometryFault::wheel || *fault == OdometryFault::rotation_reversed;
    constexpr double clear = 0.4;  // of the motion, squared: a small contradiction fits any offset
    if (may_be_late && comparison.contradiction > clear * clear * comparison.motion) {
      if (const auto late = at_another_instant(window, comparison.contradiction)) return late;
    }
    // An onset within the window gives a mixture, which the next ones do not.
    const bool last = window == std::end(kWindows)[-1];
    if (*fault == OdometryFault::inconsistent && (!last || !comparison.totals_differ())) continue;
    return Verdict{*fault, comparison.figures(), false, comparison.position_excited(),
                   comparison.yaw_excited()};
  }
  return agreement;
}

std::optional<OdometrySanity::Verdict> OdometrySanity::at_another_instant(double window,
                                                                          double contradiction) const {
  constexpr double explained = 0.15;
  double best = explained * contradiction, offset = 0;
  for (double at = -kLargestOffset; at <= kLargestOffset + 1e-9; at += kOffsetStep) {
    if (std::abs(at) < kSmallestOffset - 1e-9) continue;
    const MotionComparison comparison = compare(pairs_at(window, at));
    if (fault_of(comparison) != OdometryFault::none || comparison.contradiction >= best) continue;
    best = comparison.contradiction;
    offset = at;
  }
  if (offset == 0 || std::abs(offset) > kLargestOffset - kOffsetStep / 2) return std::nullopt;
  return Verdict{OdometryFault::delayed,
                 seconds_text(offset > 0 ? "its stamps are %.2f s late" : "its stamps are %.2f s early",
                              std::abs(offset))};
}

bool OdometrySanity::laser_repeats(double window) const {
  const std::size_t scans = scans_within(window);
  std::size_t repeated = 0;
  for (std::size_t age = 0; age < scans; ++age) repeated += steps_.newest(age).repeated ? 1 : 0;
  return 2 * repeated > scans;
}

void OdometrySanity::end_finding(SensorTime now) {
  if (lasting_) findings_[*lasting_].until = now;
  lasting_.reset();
}

void OdometrySanity::give_up(SensorTime now) {
  end_finding(now);
  fault_ = usual_fault_;
  agreeing_ = 0;
  steps_.clear();
}

bool OdometrySanity::is_mounting_doubtful() const {
  return (fault_ == OdometryFault::translation_reversed && !agreed_along_) ||
         (fault_ == OdometryFault::rotation_reversed && !agreed_turning_) ||
         (fault_ == OdometryFault::reversed && !agreed_along_ && !agreed_turning_);
}

void OdometrySanity::froze(SensorTime now) {
  if (fault_ != OdometryFault::none) return;
  fault_ = OdometryFault::frozen;
  agreeing_ = 0;
  lasting_ = findings_.size();
  findings_.push_back({fault_, now, std::nullopt, std::string(advice(fault_)) + " (scans turn meanwhile)"});
}

/// The scans before and after say nothing of odometry.
void OdometrySanity::picked_up(SensorTime now) {
  give_up(now);
  fault_ = OdometryFault::carried;
  lasting_ = findings_.size();
  findings_.push_back({fault_, now, std::nullopt,
                       std::string(advice(fault_)) + " (all around it has changed from scan to scan)"});
}

void OdometrySanity::found_again(SensorTime now) { give_up(now); }

/// Verdicts in a row.
int OdometrySanity::enough_of(const Verdict& verdict) const {
  // While a drive shows only a part of it, one fault looks like another, as a dead wheel does like a wrong
  // scale: it gets another name later each time.
  const std::size_t renamed = lasting_ ? std::min<std::size_t>(findings_.size() - 1, 4) : 0;
  switch (verdict.fault) {
    case OdometryFault::none:
      // A fault that comes back is believed to be over later each time.
      return kClearances << std::min<std::size_t>(findings_.size(), 4);
    case OdometryFault::inconsistent:
      return kLastResort << renamed;
    case OdometryFault::delayed:
      return verdict.by_clock ? kConfirmations : kLastResort;
    default:
      return verdict.by_clock ? kConfirmations : kMotionConfirmations << renamed;
  }
}

/// Only the motion that showed a fault can show that it is over.
bool OdometrySanity::may_end(const Verdict& verdict) const {
  switch (fault_) {
    case OdometryFault::translation_reversed:
      return verdict.position_shown;
    case OdometryFault::rotation_reversed:
      return verdict.yaw_shown;
    case OdometryFault::reversed:
    case OdometryFault::wheel:
    case OdometryFault::scale:
      return verdict.position_shown && verdict.yaw_shown;
    default:
      return true;
  }
}

/// Both parts of `reversed` show one after the other: straight ahead, then on the spot.
OdometryFault OdometrySanity::with_what_is_hidden(const Verdict& verdict) const {
  const bool drives = verdict.fault == OdometryFault::translation_reversed && !verdict.yaw_shown;
  const bool turns = verdict.fault == OdometryFault::rotation_reversed && !verdict.position_shown;
  const bool reversed = fault_ == OdometryFault::reversed;
  const bool other = (drives && fault_ == OdometryFault::rotation_reversed) ||
                     (turns && fault_ == OdometryFault::translation_reversed);
  return (reversed && (drives || turns)) || other ? OdometryFault::reversed : verdict.fault;
}

void OdometrySanity::settle(std::optional<Verdict> verdict, SensorTime now) {
  if (!verdict) return;
  verdict->fault = with_what_is_hidden(*verdict);
  const bool over = verdict->fault == OdometryFault::none;
  if (over && !may_end(*verdict)) return;
  if (agreeing_ == 0 || verdict->fault != suspected_.fault) {
    agreeing_ = 0;
    suspected_since_ = now;
  }
  suspected_ = *verdict;
  ++agreeing_;
  if (over && agreeing_ >= (fault_ == OdometryFault::none ? kMotionConfirmations : enough_of(*verdict))) {
    agreed_along_ |= verdict->position_shown;
    agreed_turning_ |= verdict->yaw_shown;
  }
  if (verdict->fault == fault_ || agreeing_ < enough_of(*verdict)) return;
  end_finding(suspected_since_);
  fault_ = verdict->fault;
  if (over) return;
  lasting_ = findings_.size();
  findings_.push_back(
      {fault_, suspected_since_, std::nullopt, std::string(advice(fault_)) + " (" + verdict->figures + ")"});
}

}  // namespace parhelion::pose

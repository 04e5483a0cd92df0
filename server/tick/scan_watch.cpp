#include "server/tick/scan_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "protocols/angle_units.hpp"
#include "protocols/channels.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration kConflictEnds = seconds(5.0);  // without a scan that has it
constexpr double kAngleError = 0.02;              // rad
constexpr double kSameRange = 0.1;                // m, of one beam in two scans
constexpr std::size_t kMinPairs = 30;             // beams with a range in both scans
constexpr std::size_t kWindow = 20;               // scans whose stamps are counted together
constexpr std::size_t kMaxNotNewer = 5;           // of them: a clock that is set back is one
constexpr double kTooOften = 0.6;                 // of scan_period

std::string number(double value, const char* how = "%.4g") {
  char text[32];
  std::snprintf(text, sizeof text, how, value);
  return text;
}

void report(const TickContext& context, const std::string& laser_name, std::string text) {
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::scans_conflict;
  event.subject = context.robot().name;
  event.object = laser_name;
  event.text = std::move(text);
  publish_event(context, event);
}

/// Whether the conflict begins with this scan.
bool begins(ScanWatch::Conflict conflict, SimulationTime now, ScanWatch& watch) {
  std::optional<SimulationTime>& seen = watch.conflict_seen[conflict];
  // Stamps are counted over windows that may be longer than that: an end is seen in a window without
  // conflict.
  const bool begun = !seen || (conflict != ScanWatch::publishers && now - *seen > kConflictEnds);
  seen = now;
  return begun;
}

ScanWatch::Form form_of(const Scan& scan) {
  return {scan.ranges.size(), double{scan.angle_min}, double{scan.angle_increment}};
}

/// A preset's beams are those of the sensor's usual settings: nobody wrote that this laser has them.
void expect(const LaserDescription& laser, const Scan& scan, ScanWatch& watch) {
  watch.described = laser.preset.empty() && laser.beams > 0;
  watch.expected = watch.described ? ScanWatch::Form{static_cast<std::size_t>(laser.beams), laser.angle_min,
                                                     laser.angle_increment}
                                   : form_of(scan);
}

bool is_same(const ScanWatch::Form& expected, const ScanWatch::Form& form) {
  const double beams = static_cast<double>(form.beams);
  return expected.beams == form.beams &&
         std::abs(expected.angle_increment - form.angle_increment) * beams <= kAngleError &&
         std::abs(std::remainder(expected.angle_min - form.angle_min, 2 * std::numbers::pi)) <= kAngleError;
}

/// rad, from the first beam to the last.
double fan(const ScanWatch::Form& form) {
  return std::abs(form.angle_increment) * (static_cast<double>(form.beams) - 1);
}

std::string text_of(const ScanWatch::Form& form) {
  return std::to_string(form.beams) + " beams from " + number(form.angle_min / kRadiansPerDegree) +
         " deg every " + number(form.angle_increment / kRadiansPerDegree) + " deg";
}

void watch_form(const TickContext& context, const Scan& scan, const std::string& channel,
                const std::string& laser_name, ScanWatch& watch) {
  const ScanWatch::Form form = form_of(scan);
  const bool impossible = fan(form) > 2 * std::numbers::pi + kAngleError;
  if (is_same(*watch.expected, form) && !impossible) return;
  if (!begins(ScanWatch::beams, context.now, watch)) return;
  std::string text = channel + ": a scan has " + text_of(form);
  if (impossible)
    text += ", a fan of " + number(fan(form) / kRadiansPerDegree, "%.0f") + " deg, more than a whole turn";
  if (!is_same(*watch.expected, form))
    text += std::string("; ") + (watch.described ? "the robot description has " : "the first scan had ") +
            text_of(*watch.expected);
  report(context, laser_name,
         text +
             "; correct the driver, or beams, angle_min and angle_increment of the robot description: "
             "virtual objects are placed by the angles in the scan");
}

/// Whether the beams are in the order opposite to that of the scan before: the ranges match better if one of
/// the scans is turned round.
bool is_reversed(const RangeConvention& convention, const std::vector<float>& before,
                 const std::vector<float>& ranges) {
  if (before.size() != ranges.size()) return false;
  std::size_t pairs = 0, same = 0, reversed_pairs = 0, reversed_same = 0;
  const auto count = [&](float a, float b, std::size_t& all, std::size_t& equal) {
    if (convention.classify(a) != BeamKind::hit || convention.classify(b) != BeamKind::hit) return;
    ++all;
    equal += std::abs(double{a} - double{b}) < kSameRange ? 1 : 0;
  };
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    count(before[i], ranges[i], pairs, same);
    count(before[ranges.size() - 1 - i], ranges[i], reversed_pairs, reversed_same);
  }
  if (pairs < kMinPairs || reversed_pairs < kMinPairs || 10 * same >= 4 * pairs ||
      10 * reversed_same <= 6 * reversed_pairs)
    return false;
  // A robot that turns before a wall sees its mirror image, too.
  const auto n = static_cast<std::ptrdiff_t>(ranges.size());
  for (std::ptrdiff_t turn = -n / 8; turn <= n / 8; ++turn) {
    std::size_t all = 0, equal = 0;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, -turn); i < std::min(n, n - turn); ++i)
      count(before[static_cast<std::size_t>(i + turn)], ranges[static_cast<std::size_t>(i)], all, equal);
    if (all >= kMinPairs && 10 * equal > 6 * all) return false;
  }
  return true;
}

void watch_order(const TickContext& context, const RangeConvention& convention, const Scan& scan,
                 const std::string& channel, const std::string& laser_name, ScanWatch& watch) {
  if (is_reversed(convention, watch.before, scan.ranges) && begins(ScanWatch::order, context.now, watch))
    report(context, laser_name,
           channel + ": the " + std::to_string(scan.ranges.size()) +
               " beams are in reverse order from this scan on, but their angles are as before; correct the "
               "driver, or change the sign of the angles: real and virtual returns are mirrored");
  watch.before.assign(scan.ranges.begin(), scan.ranges.end());
}

std::string look_for_a_second(const std::string& channel) {
  return "; check whether two programs publish on " + channel +
         "; if so, stop one or give it another channel";
}

void watch_publishers(const TickContext& context, double scan_period, SensorTime stamp,
                      const std::string& channel, const std::string& laser_name, ScanWatch& watch) {
  const bool not_newer = watch.newest && stamp <= *watch.newest;
  watch.newest = stamp;
  if (watch.counted == 0) watch.first = watch.last = stamp;
  watch.first = std::min(watch.first, stamp);
  watch.last = std::max(watch.last, stamp);
  watch.not_newer += not_newer ? 1 : 0;
  if (++watch.counted < kWindow) return;
  const double span = (watch.last - watch.first).seconds();
  const double period = span / static_cast<double>(kWindow - 1);
  const std::size_t backwards = watch.not_newer;
  watch.counted = watch.not_newer = 0;
  if (backwards > kMaxNotNewer) {
    if (begins(ScanWatch::publishers, context.now, watch))
      report(context, laser_name,
             channel + ": of " + std::to_string(kWindow) + " stamps " + std::to_string(backwards) +
                 " are not newer than the one before" + look_for_a_second(channel));
  } else if (period > 0 && period < kTooOften * scan_period) {
    if (begins(ScanWatch::publishers, context.now, watch))
      report(context, laser_name,
             channel + ": " + number(1 / period, "%.3g") +
                 " scans a second by their stamps, but scan_period " + "of the robot description is " +
                 number(scan_period) + " s (" + number(1 / scan_period, "%.3g") + " a second)" +
                 look_for_a_second(channel));
  } else if (std::optional<SimulationTime>& seen = watch.conflict_seen[ScanWatch::publishers];
             seen && context.now - *seen > kConflictEnds) {
    seen.reset();
  }
}

}  // namespace

void watch_scans(const TickContext& context, const Scan& scan, std::size_t laser,
                 const std::string& laser_name, ScanWatch& watch) {
  const LaserDescription& description = context.robot().laser_at(laser);
  const std::string& channel = context.channel(channel::kScan, laser);
  watch_publishers(context, description.scan_period, scan.stamp, channel, laser_name, watch);
  if (!scan.angles.empty() || scan.ranges.empty()) return;
  if (!watch.expected) expect(description, scan, watch);
  watch_form(context, scan, channel, laser_name, watch);
  watch_order(context, description.convention, scan, channel, laser_name, watch);
}

}  // namespace parhelion::tick

#include "tools/arrivals.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <set>
#include <utility>

#include "protocols/quantile.hpp"

namespace parhelion::tools {
namespace {

/// s; of instants as far apart as damaged events have them, too.
double between(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-9 * (static_cast<double>(to_ns) - static_cast<double>(from_ns));
}

/// Importers write the stamp where the source has no time of arrival, or a little more where another message
/// has that already.
bool has_arrivals(const Arrivals& messages) {
  constexpr std::int64_t kMoved = 100;  // us
  std::size_t others = 0;
  for (std::size_t i = 0; i < messages.stamps.size(); ++i)
    others += std::abs(messages.stamps[i].utime() - messages.arrivals[i].utime()) > kMoved;
  return 2 * others > messages.stamps.size();
}

/// Whether odometry's own delay can be told from that of the scans.
bool are_independent(const Arrivals& scans, const Arrivals& odometry) {
  const std::set<SensorTime> others(odometry.stamps.begin(), odometry.stamps.end());
  const auto shared = std::count_if(scans.stamps.begin(), scans.stamps.end(),
                                    [&](SensorTime stamp) { return others.contains(stamp); });
  return has_arrivals(scans) && has_arrivals(odometry) &&
         2 * static_cast<std::size_t>(shared) < scans.stamps.size();
}

}  // namespace

void Arrivals::add(SensorTime stamp, ArrivalTime arrival) {
  stamps.push_back(stamp);
  arrivals.push_back(arrival);
}

double stamp_rate(const Arrivals& messages) {
  constexpr double kSpan = 2;
  std::vector<double> rates;
  for (std::size_t from = 0, to = 1; to < messages.stamps.size(); ++to) {
    const double span = between(messages.arrivals[from].ns, messages.arrivals[to].ns);
    if (span >= 0 && span < kSpan) continue;
    if (span > 0) rates.push_back(between(messages.stamps[from].ns, messages.stamps[to].ns) / span);
    from = to;
  }
  return rates.empty() ? 1 : median(std::move(rates));
}

std::optional<double> lag_between(const Arrivals& first, const Arrivals& second) {
  std::vector<double> lags;
  std::size_t next = 0;
  for (std::size_t i = 0; i < first.stamps.size(); ++i) {
    while (next < second.stamps.size() && second.arrivals[next] <= first.arrivals[i]) ++next;
    if (next == 0) continue;
    lags.push_back(between(second.stamps[next - 1].ns, second.arrivals[next - 1].ns) -
                   between(first.stamps[i].ns, first.arrivals[i].ns));
  }
  if (lags.empty()) return std::nullopt;
  return median(std::move(lags));
}

ScanArrival scan_arrival(const Arrivals& scans, const Arrivals& odometry) {
  ScanArrival result;
  if (are_independent(scans, odometry)) result.odometry_lag = lag_between(scans, odometry);
  std::vector<double> delays;
  for (std::size_t i = 0; i < scans.stamps.size(); ++i)
    delays.push_back(between(scans.stamps[i].ns, scans.arrivals[i].ns));
  if (!delays.empty()) result.delay = median(std::move(delays));
  return result;
}

bool has_another_clock(const ScanArrival& arrival) {
  constexpr double kAnotherClock = 2;  // s, as SLAM: odometry that is so far from the scans is of no use
  return arrival.odometry_lag && std::abs(*arrival.odometry_lag) > kAnotherClock;
}

std::string clock_advice(double odometry_lag) {
  char text[256];
  std::snprintf(text, sizeof text,
                "stamps are %.1f s %s those of ODOMETRY that arrives with them: one of the two has another "
                "clock. Synchronise the clocks, or give odometry in the robot description a time_offset of "
                "%.1f s, then let calibrate measure the rest",
                std::abs(odometry_lag), odometry_lag > 0 ? "ahead of" : "behind", odometry_lag);
  return text;
}

std::optional<double> early_arrival(const LaserDescription& laser, std::size_t beams,
                                    const ScanArrival& arrival) {
  constexpr double kOdometryDelay = 0.02;  // s from the measurement of odometry to its arrival
  if (!arrival.odometry_lag || beams == 0 || laser.stamp_beam == LaserDescription::StampBeam::last)
    return std::nullopt;
  const double last = std::max(laser.beam_time(0, beams), laser.beam_time(beams - 1, beams)).seconds();
  const double early = last + std::min(*arrival.odometry_lag, -arrival.delay);
  if (early <= std::max(last / 2, kOdometryDelay) || has_another_clock(arrival)) return std::nullopt;
  return early;
}

bool is_stamped_at_arrival(const LaserDescription& laser, std::size_t beams, const ScanArrival& arrival) {
  const auto early = early_arrival(laser, beams, arrival);
  if (!early) return false;
  const double last = std::max(laser.beam_time(0, beams), laser.beam_time(beams - 1, beams)).seconds();
  return *early > 0.8 * last && std::abs(*arrival.odometry_lag + arrival.delay) < last / 2;
}

std::string stamp_beam_advice(double early) {
  char text[256];
  std::snprintf(text, sizeof text,
                "stamp_beam: scans arrive %.4g ms before the instant that the description gives for their "
                "last beam; the driver probably takes the time when a scan arrives: set stamp_beam: last, "
                "then let calibrate measure the rest",
                1e3 * early);
  return text;
}

}  // namespace parhelion::tools

#include "server/station/sensor_watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "protocols/quantile.hpp"

namespace parhelion::station {
namespace {

constexpr Duration kWindow = seconds(10.0);  // window of rate and loss

/// Period in s; 0: fewer than two stamps. Usually the median gap, so that losses appear as longer gaps. A
/// sensor that is sampled at the ticks of a faster clock (100 Hz at 120) has longer gaps at regular
/// intervals: any twenty gaps take equally long, give or take a tick. The period is then the mean gap.
double period_of(const std::deque<SensorTime>& stamps) {
  constexpr std::size_t row = 20, too_many_to_be_chance = 4;
  std::vector<double> gaps;
  for (std::size_t i = 1; i < stamps.size(); ++i) gaps.push_back((stamps[i] - stamps[i - 1]).seconds());
  if (gaps.empty()) return 0;
  const double usual = median(gaps);
  const auto is_longer = [usual](double gap) { return gap > 1.25 * usual; };
  const auto longer = static_cast<std::size_t>(std::count_if(gaps.begin(), gaps.end(), is_longer));
  if (gaps.size() < 2 * row || longer < too_many_to_be_chance) return usual;
  double shortest = std::numeric_limits<double>::infinity(), longest = 0;
  for (std::size_t i = row; i < stamps.size(); ++i) {
    const double lasts = (stamps[i] - stamps[i - row]).seconds();
    shortest = std::min(shortest, lasts);
    longest = std::max(longest, lasts);
  }
  if (longest - shortest > 1.5 * usual) return usual;
  return (stamps.back() - stamps.front()).seconds() / static_cast<double>(gaps.size());
}

}  // namespace

const char* to_string(SensorState::Health status) {
  static constexpr const char* names[] = {"none", "ok", "late", "lost"};
  return names[static_cast<std::size_t>(status)];
}

void SensorWatch::record(const std::string& name, SensorTime stamp, ArrivalTime arrival) {
  const auto sensor =
      std::find_if(sensors_.begin(), sensors_.end(), [&](const Sensor& each) { return each.name == name; });
  if (sensor == sensors_.end()) return;
  if (sensor->clock == Clock::robot) robot_clock_.add(arrival, stamp);
  auto& stamps = sensor->stamps;
  // The clock was set, or a recording was rewound.
  if (!stamps.empty() && stamp <= stamps.back()) stamps.clear();
  stamps.push_back(stamp);
  while (stamps.size() > kKept || stamps.back() - stamps.front() > kWindow) stamps.pop_front();
}

SimulationTime SensorWatch::to_server(SensorTime t) const {
  return robot_clock_.known() ? robot_clock_.to_server(t) : SimulationTime{t.ns};
}

std::vector<SensorState> SensorWatch::states(ArrivalTime now) const {
  std::vector<SensorState> states;
  for (const Sensor& sensor : sensors_) {
    SensorState& state = states.emplace_back();
    state.name = sensor.name;
    if (sensor.stamps.empty()) continue;
    const SensorTime newest = sensor.stamps.back();
    const SimulationTime taken = sensor.clock == Clock::robot ? to_server(newest) : SimulationTime{newest.ns};
    state.age = std::max(0.0, (simulation_time(now) - taken).seconds());
    double period = 0;
    if (sensor.stamps.size() > 1) {
      const double span = (newest - sensor.stamps.front()).seconds();
      const auto gaps = static_cast<double>(sensor.stamps.size() - 1);
      period = period_of(sensor.stamps);
      state.rate = gaps / span;
      state.loss = std::max(0.0, 1 - gaps / std::max(1.0, std::round(span / period)));
    }
    const bool lost = state.age > std::max(1.0, 10 * period), late = state.age > std::max(0.15, 3 * period);
    state.status = lost   ? SensorState::Health::lost
                   : late ? SensorState::Health::late
                          : SensorState::Health::ok;
  }
  return states;
}

std::optional<double> SensorWatch::silence_of(const std::string& name, ArrivalTime now) const {
  for (const SensorState& each : states(now)) {
    if (each.name == name && each.status == SensorState::Health::lost) return each.age;
  }
  return std::nullopt;
}

void SensorWatch::restart() {
  for (Sensor& sensor : sensors_) sensor.stamps.clear();
  robot_clock_ = {};
}

}  // namespace parhelion::station

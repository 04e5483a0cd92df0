// How each sensor and each output comes: rate, age, loss.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "protocols/time.hpp"
#include "server/tick/clock_offset.hpp"

namespace parhelion::station {

struct SensorState {
  enum class Word : std::uint8_t {
    none,  ///< it has never come
    ok,
    late,  ///< three periods, and more than 150 ms
    lost,  ///< ten periods, and more than a second
  };
  std::string name;  ///< canonical channel
  double rate = 0;   ///< Hz
  double age = 0;    ///< s, since the instant that the newest speaks of
  double loss = 0;   ///< share of the newest that did not come, by the gaps between stamps
  Word word = Word::none;
};
const char* to_string(SensorState::Word word);

/// Not thread-safe.
class SensorWatch {
 public:
  enum class Clock : std::uint8_t { robot, server };  ///< that stamps it

  void watch(std::string name, Clock clock) { sensors_.push_back({std::move(name), clock, {}}); }
  /// `arrival`: on the server's axis. An unknown name is passed over.
  void heard(const std::string& name, SensorTime stamp, ArrivalTime arrival);
  /// In the order of watch().
  std::vector<SensorState> states(ArrivalTime now) const;
  /// Where an instant of the robot's clock lies on the server's axis; it is taken as it is while nothing is
  /// known of that clock.
  SimulationTime to_server(SensorTime t) const;
  void restart();

 private:
  static constexpr std::size_t kept = 64;
  struct Sensor {
    std::string name;
    Clock clock = Clock::robot;
    std::deque<SensorTime> stamps;  ///< the newest last
  };
  std::vector<Sensor> sensors_;
  tick::ClockOffset robot_clock_;
};

}  // namespace parhelion::station

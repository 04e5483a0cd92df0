// Rate, age and loss of each sensor and each output.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "protocols/time.hpp"
#include "server/tick/clock_offset.hpp"

namespace parhelion::station {

struct SensorState {
  enum class Health : std::uint8_t {
    none,  ///< no message yet
    ok,
    late,  ///< three periods, and more than 150 ms
    lost,  ///< ten periods, and more than a second
  };
  std::string name;  ///< canonical channel
  double rate = 0;   ///< Hz
  double age = 0;    ///< s, since the stamp of the newest message
  double loss = 0;   ///< fraction of the newest messages that is missing, by the gaps between stamps
  Health status = Health::none;
};
const char* to_string(SensorState::Health status);

/// Not thread-safe.
class SensorWatch {
 public:
  enum class Clock : std::uint8_t { robot, server };  ///< clock of the stamps

  void watch(std::string name, Clock clock) { sensors_.push_back({std::move(name), clock, {}}); }
  /// `arrival`: on the server's axis. Unknown names are ignored.
  void record(const std::string& name, SensorTime stamp, ArrivalTime arrival);
  /// In the order of watch().
  std::vector<SensorState> states(ArrivalTime now) const;
  /// s since the newest message of a sensor that is lost; nullopt: it is not, or nothing came from it yet.
  std::optional<double> silence_of(const std::string& name, ArrivalTime now) const;
  /// Converts an instant of the robot's clock to the server's axis; unchanged while the clock offset is
  /// unknown.
  SimulationTime to_server(SensorTime t) const;
  void restart();

 private:
  static constexpr std::size_t kKept = 64;
  struct Sensor {
    std::string name;
    Clock clock = Clock::robot;
    std::deque<SensorTime> stamps;  ///< newest last
  };
  std::vector<Sensor> sensors_;
  tick::ClockOffset robot_clock_;
};

}  // namespace parhelion::station

// What a simulated robot has left of radio and battery.
#pragma once

#include <optional>

namespace parhelion::simulation {

/// Remaining supply of a simulated robot at the newest step; only values enabled by the scenario.
struct SupplyState {
  std::optional<double> radio_power;  ///< dBm received from its operator's console
  bool radio_lost = false;
  std::optional<double> battery_left;  ///< fraction, 0..1
  bool battery_empty = false;
};

}  // namespace parhelion::simulation

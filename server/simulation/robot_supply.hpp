// What keeps a simulated robot going: its operator's radio link and its battery.
#pragma once

#include <optional>

#include "protocols/hazard.hpp"

namespace parhelion::simulation {

/// dBm at a receiver `distance` m away behind `walls` walls: free space up to 1 m (Friis 1946), from there
/// the log-distance model with a loss for each wall (Motley and Keenan 1988).
double received_power(const Radio& radio, double distance, int walls);

/// W that a robot takes from its battery: `drive` W of its runners at their surface, `joints` W of its
/// joints, and what rolling takes of `mass` kg at `speed` m/s. Nothing is fed back into it.
double battery_power(const Battery& battery, double mass, double speed, double drive, double joints);

struct RobotSupply {
  std::optional<double> radio_power;  ///< dBm
  bool radio_lost = false;
  double used = 0;  ///< J
  bool low = false, empty = false;
};

}  // namespace parhelion::simulation

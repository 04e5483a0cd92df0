// Models of a simulated robot's radio link to its operator and of its battery.
#pragma once

#include <optional>

#include "protocols/hazard.hpp"

namespace parhelion::simulation {

/// dBm at a receiver `distance` m away behind `walls` walls: free space up to 1 m (Friis 1946), beyond it the
/// log-distance model with a loss for each wall (Motley and Keenan 1988).
double received_power(const Radio& radio, double distance, int walls);

/// W drawn from a robot's battery: `drive` W of its runners at their surface, `joints` W of its joints, and
/// the rolling resistance of `mass` kg at `speed` m/s. No recuperation.
double battery_power(const Battery& battery, double mass, double speed, double drive, double joints);

struct RobotSupply {
  std::optional<double> radio_power;  ///< dBm
  bool radio_lost = false;
  double used = 0;  ///< J
  bool low = false, empty = false;
};

}  // namespace parhelion::simulation

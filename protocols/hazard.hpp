// Hazards of a scenario, its radio link and its batteries; and the measurements of a robot's hazard sensor
// (channel HAZARD).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion {

enum class HazardKind : std::uint8_t {
  device,     ///< triggered by shock, tilt, proximity or time
  radiation,  ///< a point source
  gas,        ///< a leak
};

/// Where `agent` is named, the hazard is attached to that agent: it exists as long as the agent, moves with
/// it, and is affected by its contacts. Else it is at `position`.
struct Hazard {
  std::string name;  ///< unique among the hazards
  HazardKind kind = HazardKind::device;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map
  std::string agent;

  // A device and its triggers, at least one. It is triggered once.
  std::optional<double> shock;     ///< N s, change of its agent's momentum within two steps
  std::optional<double> tilt;      ///< rad, between its z axis and up; its agent's
  std::optional<double> nearness;  ///< m, in the plane, from its position to the outline of a robot or person
  std::optional<double> delay;     ///< s after the session's start

  double strength = 0;  ///< radiation: uSv/h at 1 m; gas: ppm at the leak
  /// Radiation: m of wall that absorbs half of it (Cs-137 in concrete, broad beam: 0.048 m, NCRP Report 49).
  double half_value = 0.048;
  double reach = 2;  ///< gas: m along the path through the air over which it falls to 1/e
};

/// The link from the operator's console to simulated robots.
struct Radio {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map, of the console's antenna
  double power = 20;                                   ///< dBm sent
  double frequency = 2.4e9;                            ///< Hz
  double exponent = 2;       ///< of the loss with distance (free space: 2; corridors 1.6 to 3.3)
  double wall_loss = 8;      ///< dB for each wall or closed door in between
  double sensitivity = -85;  ///< dBm, below which the link is lost
  double restore = 3;        ///< dB above the sensitivity at which it is restored
};

/// Battery of each simulated robot.
struct Battery {
  double capacity = 360e3;  ///< J
  double idle = 20;         ///< W consumed by computer and sensors
  double efficiency = 0.6;  ///< of its drive: work at the wheels over energy from the battery
  double rolling = 0.03;    ///< rolling resistance over weight
  double low = 0.2;         ///< remaining fraction at which the operator is warned
  double charge = 1;        ///< fraction of the capacity at the start, above 0
};

/// Response of a robot's hazard sensor. The defaults are those of a hand-held ratemeter and of an
/// electrochemical cell.
struct HazardSensor {
  /// s, time constant of a first-order lag: equivalent to 4 s from 10 to 90 % (Ludlum Model 3, fast
  /// response).
  double radiation_lag = 1.8;
  /// Hz, counts at 1 uSv/h (LND 712 tube: 18 a second at 1 mR/h of Co-60); 0: no counting noise.
  double radiation_counts = 1.8;
  double gas_lag = 6.5;    ///< s, time constant for gas: equivalent to 15 s to 90 % (Alphasense CO-B4)
  double gas_noise = 0.5;  ///< ppm, 1 sigma: half of the display step of portable detectors
  bool operator==(const HazardSensor&) const = default;
};

/// Doses of a robot since the start of the session that are events: uSv of radiation, ppm min of gas. None:
/// no event.
struct DoseLimits {
  struct Limit {
    std::optional<double> warning, limit;
    bool operator==(const Limit&) const = default;
  };
  Limit radiation, gas;
  bool operator==(const DoseLimits&) const = default;
};

/// An Error that names what is wrong, or success.
Status check(const DoseLimits& limits);
Status check(const Hazard& hazard);
Status check(const HazardSensor& sensor);
Status check(const Radio& radio);
Status check(const Battery& battery);

/// Measurement of a robot's hazard sensor, summed over all sources of a kind, for each kind in the scenario:
/// the rate or concentration with lag and noise, then the doses since the start of the session.
struct HazardReading {
  struct Value {
    HazardKind kind = HazardKind::radiation;
    double value = 0;
    std::string unit;  ///< "uSv/h" of radiation, "ppm" of gas; of their doses "uSv" and "ppm min"
  };
  SensorTime stamp;  ///< instant of the measurement
  std::vector<Value> values;
};

const char* to_string(HazardKind kind);

}  // namespace parhelion

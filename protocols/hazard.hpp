// Hazards of a scenario, its radio link and its batteries; and what a robot's hazard sensor reads (channel
// HAZARD).
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
  device,     ///< set off by shock, tilt, nearness or time
  radiation,  ///< a point source
  gas,        ///< a leak
};

/// Where `agent` is named, the hazard is that agent: it is there while the agent is, goes where it goes, and
/// feels what hits it. Else it is at `position`.
struct Hazard {
  std::string name;  ///< unique among the hazards
  HazardKind kind = HazardKind::device;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map
  std::string agent;

  // A device: what sets it off; at least one. It is set off once.
  std::optional<double> shock;     ///< N s, by which two steps change its agent's momentum
  std::optional<double> tilt;      ///< rad, between its z axis and up; its agent's
  std::optional<double> nearness;  ///< m, in the plane, from its place to the outline of a robot or person
  std::optional<double> delay;     ///< s after the session's start

  double strength = 0;  ///< radiation: uSv/h at 1 m; gas: ppm at the leak
  /// Radiation: m of wall that lets half of it through (Cs-137 in concrete, broad beam: 0.048 m, NCRP
  /// Report 49).
  double half_value = 0.048;
  double reach = 2;  ///< gas: m of way through the air in which it falls to 1/e
};

/// The link from the operator's console to simulated robots.
struct Radio {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map, of the console's antenna
  double power = 20;                                   ///< dBm sent
  double frequency = 2.4e9;                            ///< Hz
  double exponent = 2;       ///< of the loss with distance (free space: 2; corridors 1.6 to 3.3)
  double wall_loss = 8;      ///< dB for each wall or closed door between
  double sensitivity = -85;  ///< dBm, below which the link is lost
  double restore = 3;        ///< dB above the sensitivity at which it is back
};

/// Of each simulated robot.
struct Battery {
  double capacity = 360e3;  ///< J
  double idle = 20;         ///< W that computer and sensors take
  double efficiency = 0.6;  ///< of its drive: work at the wheels over what the battery gives
  double rolling = 0.03;    ///< rolling resistance over weight
  double low = 0.2;         ///< share left at which the operator is warned
  double charge = 1;        ///< share left at the start, above 0
};

/// How a robot's hazard sensor answers to what is there. The defaults are those of a hand-held ratemeter and
/// of an electrochemical cell.
struct HazardSensor {
  /// s, time constant of a first-order lag: of 4 s from 10 to 90 % (Ludlum Model 3, fast response).
  double radiation_lag = 1.8;
  /// Hz, counts at 1 uSv/h (LND 712 tube: 18 a second at 1 mR/h of Co-60); 0: it does not count, and is
  /// exact.
  double radiation_counts = 1.8;
  double gas_lag = 6.5;    ///< s, the same of gas: of 15 s to 90 % (Alphasense CO-B4)
  double gas_noise = 0.5;  ///< ppm, 1 sigma: half of the step in which portable detectors show
  bool operator==(const HazardSensor&) const = default;
};

/// What is wrong, or nothing.
Status check(const Hazard& hazard);
Status check(const HazardSensor& sensor);
Status check(const Radio& radio);
Status check(const Battery& battery);

/// What the hazard sensor of a robot reads of the sum over all sources of a kind, for each kind that the
/// scenario has: with its lag and its noise.
struct HazardReading {
  struct Value {
    HazardKind kind = HazardKind::radiation;
    double value = 0;
    std::string unit;  ///< "uSv/h" of radiation, "ppm" of gas
  };
  SensorTime stamp;  ///< instant of the measurement
  std::vector<Value> values;
};

const char* to_string(HazardKind kind);

}  // namespace parhelion

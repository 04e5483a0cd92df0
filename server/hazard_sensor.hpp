// What a hazard sensor makes of what is there: it lags behind, and it is noisy.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/hazard.hpp"

namespace parhelion {

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
};

/// How many of the events that come `mean` times on average come now (Poisson), from a draw of the standard
/// normal distribution: exact by its distribution function below 30, else by the normal approximation with a
/// correction of half a count.
double poisson_count(double mean, double normal);

/// Each reading takes one step of a first-order lag; its draws depend on the seed, the kind and the number of
/// the reading alone.
class HazardResponse {
 public:
  /// Turns `reading`, what is there `period` s after the last one, into what the sensor says. The first
  /// reading of a kind finds a sensor that has been there for long.
  void measure(const HazardSensor& sensor, std::uint64_t seed, double period, HazardReading& reading);

 private:
  double radiation(const HazardSensor& sensor, std::uint64_t seed, double period, double truth);
  double gas(const HazardSensor& sensor, std::uint64_t seed, double period, double truth);
  std::uint64_t readings_ = 0;
  std::optional<double> radiation_, gas_;
};

}  // namespace parhelion

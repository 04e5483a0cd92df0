// What a hazard sensor makes of what is there: it lags behind, and it is noisy.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/hazard.hpp"

namespace parhelion::tick {

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

}  // namespace parhelion::tick

// Model of a hazard sensor: lag and noise.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/hazard.hpp"

namespace parhelion::tick {

/// A Poisson-distributed count with the given mean, from a draw of the standard normal distribution: exact by
/// the distribution function below 30, above it by the normal approximation with a continuity correction of
/// 0.5.
double poisson_count(double mean, double normal);

/// Each reading takes one step of a first-order lag. The draws depend only on the seed, the kind and the
/// number of the reading.
class HazardResponse {
 public:
  /// Replaces `reading`, the true value `period` s after the last one, by the measured value. For the first
  /// reading of a kind the sensor is in steady state.
  void measure(const HazardSensor& sensor, std::uint64_t seed, double period, HazardReading& reading);

 private:
  double radiation(const HazardSensor& sensor, std::uint64_t seed, double period, double truth);
  double gas(const HazardSensor& sensor, std::uint64_t seed, double period, double truth);
  std::uint64_t readings_ = 0;
  std::optional<double> radiation_, gas_;
};

}  // namespace parhelion::tick

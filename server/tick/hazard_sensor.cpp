#include "server/tick/hazard_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fusion/scan/lidar_model.hpp"

namespace parhelion::tick {
namespace {

constexpr std::uint64_t kRadiationStream = 0x68617A72ULL << 32;  // independent of all other draws of a seed
constexpr std::uint64_t kGasStream = 0x68617A67ULL << 32;
constexpr double kMany = 30;  // events: above this the count is nearly normally distributed

/// Fraction of a step response that a first-order lag reaches in `period`.
double fraction(double lag, double period) { return lag > 0 ? -std::expm1(-period / lag) : 1; }

}  // namespace

double poisson_count(double mean, double normal) {
  if (!(mean > 0)) return 0;
  if (mean >= kMany) return std::max(0.0, std::floor(mean + std::sqrt(mean) * normal + 0.5));
  const double quantile = 0.5 * std::erfc(-normal / std::numbers::sqrt2);
  double probability = std::exp(-mean), sum = probability;
  double count = 0;
  while (sum < quantile && count < 10 * kMany) {
    ++count;
    probability *= mean / count;
    sum += probability;
  }
  return count;
}

/// A ratemeter: counts of a tube through an RC circuit (Knoll, Radiation Detection and Measurement, 4th ed.,
/// section 17.V: their relative standard deviation is 1 / sqrt(2 rate lag)).
double HazardResponse::radiation(const HazardSensor& sensor, std::uint64_t seed, double period,
                                 double truth) {
  double counted = truth;
  if (sensor.radiation_counts > 0) {
    const double each = 1 / (sensor.radiation_counts * period);  // uSv/h of one count
    counted =
        each * poisson_count(truth / each, scan::standard_normal({seed, kRadiationStream | readings_}, 0));
  }
  if (!radiation_) radiation_ = truth;
  *radiation_ += fraction(sensor.radiation_lag, period) * (counted - *radiation_);
  return *radiation_;
}

double HazardResponse::gas(const HazardSensor& sensor, std::uint64_t seed, double period, double truth) {
  if (!gas_) gas_ = truth;
  *gas_ += fraction(sensor.gas_lag, period) * (truth - *gas_);
  return std::max(0.0, *gas_ + sensor.gas_noise * scan::standard_normal({seed, kGasStream | readings_}, 0));
}

void HazardResponse::measure(const HazardSensor& sensor, std::uint64_t seed, double period,
                             HazardReading& reading) {
  ++readings_;
  for (HazardReading::Value& value : reading.values) {
    value.value = value.kind == HazardKind::gas ? gas(sensor, seed, period, value.value)
                                                : radiation(sensor, seed, period, value.value);
  }
}

}  // namespace parhelion::tick

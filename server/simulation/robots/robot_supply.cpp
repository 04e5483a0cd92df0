#include "server/simulation/robots/robot_supply.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocols/gravity.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kLightSpeed = 299'792'458;  // m/s

}  // namespace

double received_power(const Radio& radio, double distance, int walls) {
  const double at_one_metre = 20 * std::log10(4 * std::numbers::pi * radio.frequency / kLightSpeed);
  const double farther = 10 * radio.exponent * std::log10(std::max(1.0, distance));
  return radio.power - at_one_metre - farther - radio.wall_loss * walls;
}

double battery_power(const Battery& battery, double mass, double speed, double drive, double joints) {
  const double rolling = battery.rolling * mass * kGravity * std::abs(speed);
  return battery.idle + (std::max(0.0, drive) + std::max(0.0, joints) + rolling) / battery.efficiency;
}

}  // namespace parhelion::simulation

#include "protocols/hazard.hpp"

#include <cmath>

#include "protocols/yaml/utf8.hpp"

namespace parhelion {
namespace {

constexpr double kMaxReach = 10;  // m: extent of the simulation's gas grid

bool positive(const std::optional<double>& value) { return !value || (std::isfinite(*value) && *value > 0); }

}  // namespace

const char* to_string(HazardKind kind) {
  switch (kind) {
    case HazardKind::device:
      return "device";
    case HazardKind::radiation:
      return "radiation";
    case HazardKind::gas:
      return "gas";
  }
  return "unknown";
}

Status check(const Hazard& hazard) {
  const std::string who = "hazard '" + yaml::printable(hazard.name) + "': ";
  if (hazard.name.empty()) return Error{"a hazard has no name: its events need one"};
  if (!hazard.position.allFinite()) return Error{who + "its position is not finite"};
  if (hazard.kind == HazardKind::device) {
    if (!hazard.shock && !hazard.tilt && !hazard.nearness && !hazard.delay)
      return Error{who + "it has no trigger; expected shock, tilt, nearness or delay"};
    if (!positive(hazard.shock) || !positive(hazard.tilt) || !positive(hazard.nearness) ||
        !positive(hazard.delay))
      return Error{who + "shock, tilt, nearness and delay must be above 0"};
    if (hazard.agent.empty() && (hazard.shock || hazard.tilt))
      return Error{who + "shock and tilt need an agent; name it: 'agent: suitcase'"};
    return {};
  }
  if (!(hazard.strength > 0) || !std::isfinite(hazard.strength))
    return Error{who + "expected a strength above 0"};
  if (!(hazard.half_value > 0) || !(hazard.reach > 0) || !(hazard.reach <= kMaxReach))
    return Error{who + "expected half_value and reach above 0, reach of at most 10 m"};
  return {};
}

Status check(const HazardSensor& sensor) {
  for (const double each :
       {sensor.radiation_lag, sensor.radiation_counts, sensor.gas_lag, sensor.gas_noise}) {
    if (!(each >= 0) || !std::isfinite(each))
      return Error{
          "hazard_sensor: expected radiation_lag, radiation_counts, gas_lag, gas_noise of at least 0"};
  }
  return {};
}

Status check(const DoseLimits& limits) {
  for (const DoseLimits::Limit& each : {limits.radiation, limits.gas}) {
    if (!positive(each.warning) || !positive(each.limit))
      return Error{"dose_limits: expected warning and limit above 0"};
    if (each.warning && each.limit && *each.warning > *each.limit)
      return Error{"dose_limits: a warning is above its limit"};
  }
  return {};
}

Status check(const Radio& radio) {
  if (!radio.position.allFinite()) return Error{"radio: its position is not finite"};
  if (!(radio.frequency > 0) || !(radio.exponent > 0) || !(radio.wall_loss >= 0) || !(radio.restore >= 0) ||
      !std::isfinite(radio.power) || !std::isfinite(radio.sensitivity))
    return Error{"radio: expected frequency and exponent above 0, wall_loss and restore of at least 0"};
  return {};
}

Status check(const Battery& battery) {
  if (!(battery.capacity > 0) || !(battery.idle >= 0) || !(battery.efficiency > 0) ||
      !(battery.efficiency <= 1) || !(battery.rolling >= 0) || !(battery.low >= 0 && battery.low < 1) ||
      !(battery.charge > 0 && battery.charge <= 1))
    return Error{
        "battery: expected capacity above 0, idle and rolling of at least 0, 0 < efficiency <= 1, 0 <= low < "
        "1, 0 < charge <= 1"};
  return {};
}

}  // namespace parhelion

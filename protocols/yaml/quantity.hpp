// Numbers with units in the files: "0.10 m", "90 deg", "240 Hz".
#pragma once

#include <string>
#include <string_view>

#include "protocols/status.hpp"

namespace parhelion::yaml {

/// The physical quantity of a number; the first unit of each is used in structs and for writing.
enum class Quantity {
  length,          ///< m, cm, mm, km
  angle,           ///< rad, deg
  time,            ///< s, ms, us, ns, min
  rate,            ///< Hz, kHz, MHz, GHz
  speed,           ///< m/s, cm/s, mm/s, km/h
  angular_speed,   ///< rad/s, deg/s
  acceleration,    ///< m/s^2
  mass,            ///< kg, g
  pixels,          ///< px
  length_ratio,    ///< m/m, %
  angle_ratio,     ///< rad/rad, deg/deg, %
  force,           ///< N, kN
  torque,          ///< N m
  impulse,         ///< N s
  energy,          ///< J, kJ, Wh
  power,           ///< W
  power_level,     ///< dBm
  loss,            ///< dB
  dose_rate,       ///< uSv/h, mSv/h
  concentration,   ///< ppm, %
  curvature,       ///< rad/m, deg/m
  digital_number,  ///< DN: one step of an 8-bit pixel
  dose,            ///< uSv, mSv
  gas_dose,        ///< ppm min, ppm h
};

/// "length" to Quantity::length; error for an unknown name.
Result<Quantity> quantity_named(std::string_view name);

/// Value in the quantity's first unit. The error states what was expected, without the position.
Result<double> parse_quantity(std::string_view text, Quantity quantity);
/// A plain finite number, all of `text`.
Result<double> parse_number(std::string_view text);

/// Shortest text that parse_quantity converts back to exactly `value`; angles in degrees where this is short
/// and exact.
std::string format_quantity(double value, Quantity quantity);
/// Shortest text that is converted back, after rounding to float, to exactly `value`.
std::string format_quantity(float value, Quantity quantity);
std::string format_number(double value);
std::string format_number(float value);

/// The first unit: "m", "rad", ...
std::string_view base_unit(Quantity quantity);

}  // namespace parhelion::yaml

#include "protocols/yaml/quantity.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <span>

#include "protocols/yaml/utf8.hpp"

namespace parhelion::yaml {
namespace {

struct Unit {
  std::string_view name;
  double multiply = 1;
  double divide = 1;  ///< separate from `multiply`, so that 20 ms is the double nearest to 0.020
};

constexpr Unit kLengths[] = {{"m"}, {"cm", 1, 100}, {"mm", 1, 1000}, {"km", 1000, 1}};
constexpr Unit kAngles[] = {{"rad"}, {"deg", std::numbers::pi, 180}};
constexpr Unit kTimes[] = {{"s"}, {"ms", 1, 1e3}, {"us", 1, 1e6}, {"ns", 1, 1e9}, {"min", 60, 1}};
constexpr Unit kRates[] = {{"Hz"}, {"kHz", 1000, 1}, {"MHz", 1e6, 1}, {"GHz", 1e9, 1}};
constexpr Unit kSpeeds[] = {{"m/s"}, {"cm/s", 1, 100}, {"mm/s", 1, 1000}, {"km/h", 1, 3.6}};
constexpr Unit kAngularSpeeds[] = {{"rad/s"}, {"deg/s", std::numbers::pi, 180}};
constexpr Unit kAccelerations[] = {{"m/s^2"}};
constexpr Unit kMasses[] = {{"kg"}, {"g", 1, 1000}};
constexpr Unit kPixelUnits[] = {{"px"}};
constexpr Unit kLengthRatios[] = {{"m/m"}, {"%", 1, 100}};
constexpr Unit kAngleRatios[] = {{"rad/rad"}, {"deg/deg"}, {"%", 1, 100}};
constexpr Unit kForces[] = {{"N"}, {"kN", 1000, 1}};
constexpr Unit kTorques[] = {{"N m"}};
constexpr Unit kImpulses[] = {{"N s"}};
constexpr Unit kEnergies[] = {{"J"}, {"kJ", 1000, 1}, {"Wh", 3600, 1}};
constexpr Unit kPowers[] = {{"W"}};
constexpr Unit kPowerLevels[] = {{"dBm"}};
constexpr Unit kLosses[] = {{"dB"}};
constexpr Unit kDoseRates[] = {{"uSv/h"}, {"mSv/h", 1000, 1}};
constexpr Unit kConcentrations[] = {{"ppm"}, {"%", 10000, 1}};
constexpr Unit kCurvatures[] = {{"rad/m"}, {"deg/m", std::numbers::pi, 180}};
constexpr Unit kDigitalNumbers[] = {{"DN"}};
constexpr Unit kDoses[] = {{"uSv"}, {"mSv", 1000, 1}};
constexpr Unit kGasDoses[] = {{"ppm min"}, {"ppm h", 60, 1}};

struct Dimension {
  std::string_view name;
  std::span<const Unit> units;
};

/// In the order of Quantity.
constexpr std::array<Dimension, 24> kDimensions{{{"length", kLengths},
                                                 {"angle", kAngles},
                                                 {"time", kTimes},
                                                 {"rate", kRates},
                                                 {"speed", kSpeeds},
                                                 {"angular_speed", kAngularSpeeds},
                                                 {"acceleration", kAccelerations},
                                                 {"mass", kMasses},
                                                 {"pixels", kPixelUnits},
                                                 {"length_ratio", kLengthRatios},
                                                 {"angle_ratio", kAngleRatios},
                                                 {"force", kForces},
                                                 {"torque", kTorques},
                                                 {"impulse", kImpulses},
                                                 {"energy", kEnergies},
                                                 {"power", kPowers},
                                                 {"power_level", kPowerLevels},
                                                 {"loss", kLosses},
                                                 {"dose_rate", kDoseRates},
                                                 {"concentration", kConcentrations},
                                                 {"curvature", kCurvatures},
                                                 {"digital_number", kDigitalNumbers},
                                                 {"dose", kDoses},
                                                 {"gas_dose", kGasDoses}}};

const Dimension& dimension(Quantity quantity) { return kDimensions[static_cast<std::size_t>(quantity)]; }

std::string accepted(Quantity quantity) {
  const auto units = dimension(quantity).units;
  std::string text;
  for (std::size_t i = 0; i < units.size(); ++i) {
    if (i > 0) text += i + 1 == units.size() ? " or " : ", ";
    text += units[i].name;
  }
  return text;
}

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// The number at the start of `text`, which is removed; a leading '+' is accepted.
Result<double> take_number(std::string_view& text) {
  std::string_view digits = text;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0;
  const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (code == std::errc::result_out_of_range) return Error{"a number that is too large or too small"};
  if (code != std::errc{}) return Error{"not a number"};
  if (!std::isfinite(value)) return Error{"not a finite number"};
  text = digits.substr(static_cast<std::size_t>(end - digits.data()));
  return value;
}

template <class Number>
std::string shortest(Number value) {
  char buffer[64];
  const auto [end, code] = std::to_chars(buffer, buffer + sizeof buffer, value);
  return code == std::errc{} ? std::string(buffer, end) : std::string();
}

std::string found(std::string_view text) { return ", found '" + printable(text) + "'"; }

}  // namespace

Result<Quantity> quantity_named(std::string_view name) {
  for (std::size_t i = 0; i < kDimensions.size(); ++i) {
    if (kDimensions[i].name == name) return static_cast<Quantity>(i);
  }
  return Error{"unknown quantity '" + std::string(name) + "'"};
}

std::string_view base_unit(Quantity quantity) { return dimension(quantity).units.front().name; }

Result<double> parse_number(std::string_view text) {
  std::string_view rest = trim(text);
  const auto value = take_number(rest);
  if (!value) return Error{"expected a finite number" + found(text)};
  if (!rest.empty()) return Error{"expected a number without a unit" + found(text)};
  return *value;
}

Result<double> parse_quantity(std::string_view text, Quantity quantity) {
  const auto expected = [&] {
    return "expected a finite number with its unit, " + accepted(quantity) + found(text);
  };
  std::string_view rest = trim(text);
  const auto number = take_number(rest);
  if (!number) return Error{expected()};
  rest = trim(rest);
  if (rest.empty()) {
    return Error{"a unit is missing: expected " + accepted(quantity) + ", such as '" +
                 std::string(trim(text)) + ' ' + std::string(base_unit(quantity)) + "'" + found(text)};
  }
  for (const Unit& unit : dimension(quantity).units) {
    if (unit.name != rest) continue;
    const double value = *number * unit.multiply / unit.divide;
    if (!std::isfinite(value)) return Error{expected()};
    return value;
  }
  return Error{expected()};
}

std::string format_number(double value) { return shortest(value); }

std::string format_number(float value) {
  std::string text = shortest(value);
  const auto back = parse_number(text);
  // Rounding twice, to double and then to float, may differ; the double's own digits cannot.
  return back && static_cast<float>(*back) == value ? text : shortest(static_cast<double>(value));
}

std::string format_quantity(double value, Quantity quantity) {
  if (quantity == Quantity::angle || quantity == Quantity::angular_speed) {
    const double degrees = std::round(value * 180 / std::numbers::pi * 1e6) / 1e6;
    std::string text = shortest(degrees) + (quantity == Quantity::angle ? " deg" : " deg/s");
    const auto back = parse_quantity(text, quantity);
    if (back && *back == value) return text;
  }
  return shortest(value) + ' ' + std::string(base_unit(quantity));
}

std::string format_quantity(float value, Quantity quantity) {
  return format_number(value) + ' ' + std::string(base_unit(quantity));
}

}  // namespace parhelion::yaml

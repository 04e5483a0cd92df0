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

constexpr Unit lengths[] = {{"m"}, {"cm", 1, 100}, {"mm", 1, 1000}, {"km", 1000, 1}};
constexpr Unit angles[] = {{"rad"}, {"deg", std::numbers::pi, 180}};
constexpr Unit times[] = {{"s"}, {"ms", 1, 1e3}, {"us", 1, 1e6}, {"ns", 1, 1e9}, {"min", 60, 1}};
constexpr Unit rates[] = {{"Hz"}, {"kHz", 1000, 1}, {"MHz", 1e6, 1}, {"GHz", 1e9, 1}};
constexpr Unit speeds[] = {{"m/s"}, {"cm/s", 1, 100}, {"mm/s", 1, 1000}, {"km/h", 1, 3.6}};
constexpr Unit angular_speeds[] = {{"rad/s"}, {"deg/s", std::numbers::pi, 180}};
constexpr Unit accelerations[] = {{"m/s^2"}};
constexpr Unit masses[] = {{"kg"}, {"g", 1, 1000}};
constexpr Unit pixel_units[] = {{"px"}};
constexpr Unit length_ratios[] = {{"m/m"}, {"%", 1, 100}};
constexpr Unit angle_ratios[] = {{"rad/rad"}, {"deg/deg"}, {"%", 1, 100}};
constexpr Unit forces[] = {{"N"}, {"kN", 1000, 1}};
constexpr Unit torques[] = {{"N m"}};
constexpr Unit impulses[] = {{"N s"}};
constexpr Unit energies[] = {{"J"}, {"kJ", 1000, 1}, {"Wh", 3600, 1}};
constexpr Unit powers[] = {{"W"}};
constexpr Unit power_levels[] = {{"dBm"}};
constexpr Unit losses[] = {{"dB"}};
constexpr Unit dose_rates[] = {{"uSv/h"}, {"mSv/h", 1000, 1}};
constexpr Unit concentrations[] = {{"ppm"}, {"%", 10000, 1}};
constexpr Unit digital_numbers[] = {{"DN"}};

struct Dimension {
  std::string_view name;
  std::span<const Unit> units;
};

/// In the order of Quantity.
constexpr std::array<Dimension, 21> dimensions{{{"length", lengths},
                                                {"angle", angles},
                                                {"time", times},
                                                {"rate", rates},
                                                {"speed", speeds},
                                                {"angular_speed", angular_speeds},
                                                {"acceleration", accelerations},
                                                {"mass", masses},
                                                {"pixels", pixel_units},
                                                {"length_ratio", length_ratios},
                                                {"angle_ratio", angle_ratios},
                                                {"force", forces},
                                                {"torque", torques},
                                                {"impulse", impulses},
                                                {"energy", energies},
                                                {"power", powers},
                                                {"power_level", power_levels},
                                                {"loss", losses},
                                                {"dose_rate", dose_rates},
                                                {"concentration", concentrations},
                                                {"digital_number", digital_numbers}}};

const Dimension& dimension(Quantity quantity) { return dimensions[static_cast<std::size_t>(quantity)]; }

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
  for (std::size_t i = 0; i < dimensions.size(); ++i) {
    if (dimensions[i].name == name) return static_cast<Quantity>(i);
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

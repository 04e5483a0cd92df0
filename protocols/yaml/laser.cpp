#include "protocols/yaml/laser.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "protocols/robot.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/quantity.hpp"

namespace parhelion::yaml {
namespace {

constexpr std::array<const char*, 3> kStampBeamNames{"first", "middle", "last"};

/// Keys that the preset supplies where they are missing.
constexpr const char* kValueKeys[] = {"range_min",   "range_max",   "no_return",    "too_close",
                                      "stamp_beam",  "passes",      "pass_period",  "beam_interval",
                                      "scan_period", "noise_sigma", "quantization", "intensity_scale",
                                      "intensities", "beams",       "angle_min",    "angle_increment"};

void read_sentinel(const Node& map, std::string_view key, RangeConvention::Sentinel& kind, float& value) {
  const Node* node = map.find(key);
  if (node == nullptr) return;
  value = static_cast<float>(node->number);
  kind = node->is_number            ? RangeConvention::Sentinel::value
         : node->text == "infinity" ? RangeConvention::Sentinel::infinity
                                    : RangeConvention::Sentinel::nan;
}

std::string format_sentinel(RangeConvention::Sentinel kind, float value) {
  switch (kind) {
    case RangeConvention::Sentinel::value:
      return format_quantity(value, Quantity::length);
    case RangeConvention::Sentinel::infinity:
      return "infinity";
    case RangeConvention::Sentinel::nan:
      return "nan";
  }
  return "nan";
}

void read_noise(const Node& map, RangeNoise& noise) {
  if (const Node* list = map.find("sigma")) {
    for (std::size_t i = 0; i < noise.sigma.size(); ++i) noise.sigma.at(i) = list->items.at(i).number;
  }
  read(map, "incidence", noise.incidence);
  read(map, "spread", noise.spread);
  read(map, "correlation", noise.correlation);
  read(map, "dropout", noise.dropout);
}

void read_codes(const Node& map, LaserDescription& laser, Problems& problems) {
  const auto numbers = [&map](const char* key, std::vector<float>& values) {
    const Node* list = map.find(key);
    if (list == nullptr) return;
    values.clear();
    for (const Node& item : list->items) values.push_back(static_cast<float>(item.number));
  };
  numbers("intensity_codes", laser.intensity_codes);
  numbers("intensity_fractions", laser.intensity_fractions);
  if (laser.intensity_codes.size() != laser.intensity_fractions.size())
    problems.add(map.line, "expected as many 'intensity_fractions' as 'intensity_codes'");
}

std::string number_list(std::span<const float> values) {
  std::string text;
  for (const float value : values) text += (text.empty() ? "[" : ", ") + format_number(value);
  return text + "]";
}

void write_noise(Writer& writer, const LaserDescription& laser) {
  const RangeNoise& noise = laser.range_noise;
  if (noise.learned()) {
    writer.open("range_noise");
    writer.line("sigma", format_lengths(noise.sigma.data(), noise.sigma.size()));
    writer.quantity("incidence", noise.incidence, Quantity::length);
    writer.number("spread", noise.spread);
    writer.number("correlation", noise.correlation);
    writer.number("dropout", noise.dropout);
    writer.close();
  }
  if (laser.intensity_codes.empty()) return;
  writer.line("intensity_codes", number_list(laser.intensity_codes));
  writer.line("intensity_fractions", number_list(laser.intensity_fractions));
}

void read_values(const Node& map, LaserDescription& laser, Problems& problems) {
  RangeConvention& convention = laser.convention;
  read(map, "range_min", convention.range_min);
  read(map, "range_max", convention.range_max);
  read_sentinel(map, "no_return", convention.no_return, convention.no_return_value);
  read_sentinel(map, "too_close", convention.too_close, convention.too_close_value);
  read(map, "stamp_beam", kStampBeamNames, laser.stamp_beam);
  read(map, "passes", laser.passes);
  read(map, "pass_period", laser.pass_period);
  read(map, "beam_interval", laser.beam_interval);
  read(map, "scan_period", laser.scan_period);
  read(map, "noise_sigma", laser.noise_sigma);
  read(map, "quantization", laser.quantization);
  if (const Node* noise = map.find("range_noise")) read_noise(*noise, laser.range_noise);
  read_codes(map, laser, problems);
  read(map, "intensity_scale", laser.intensity_scale);
  read(map, "intensities", laser.intensities);
  read(map, "beams", laser.beams);
  read(map, "angle_min", laser.angle_min);
  read(map, "angle_increment", laser.angle_increment);
  read(map, "source", laser.source);
  if (convention.range_max == 0) {
    problems.add(map.line, "key 'range_max' is missing in 'laser'");
  } else if (!(convention.range_min < convention.range_max)) {
    problems.add(map.line, "expected range_min < range_max, found " +
                               format_quantity(convention.range_min, Quantity::length) + " and " +
                               format_quantity(convention.range_max, Quantity::length));
  }
  if (laser.beams > 1 && laser.angle_increment == 0) {
    problems.add(map.line, "expected angle_increment != 0 rad where beams > 1");
  }
}

}  // namespace

LaserDescription read_preset(const Node& map, Problems& problems) {
  for (const char* key : {"name", "pose", "head", "preset"}) {
    if (const Node* node = map.find(key)) {
      problems.add(node->line,
                   std::string("a preset has no '") + key + "': it belongs in the robot description");
    }
  }
  LaserDescription laser;
  read_values(map, laser, problems);
  return laser;
}

LaserDescription read_laser(const Node& map, Problems& problems) {
  LaserDescription laser;
  const bool complete = std::all_of(std::begin(kValueKeys), std::end(kValueKeys),
                                    [&](const char* key) { return map.find(key) != nullptr; });
  if (const Node* preset = map.find("preset"); preset != nullptr && !complete) {
    auto loaded = load_laser_preset(preset->text);
    if (!loaded) {
      problems.add(preset->line, loaded.error().message);
      return laser;
    }
    laser = std::move(*loaded);
  }
  read(map, "preset", laser.preset);
  read(map, "pose", laser.T_base_laser, problems);
  // An unknown mounting must never become an identity.
  if (map.find("pose") == nullptr)
    problems.add(map.line, "key 'pose' is missing in 'laser': its pose in base_link");
  read_values(map, laser, problems);
  return laser;
}

void write_laser(Writer& writer, const LaserDescription& laser) {
  if (!laser.preset.empty()) writer.text("preset", laser.preset);
  writer.line("pose", format_isometry(laser.T_base_laser.isometry()));
  const RangeConvention& convention = laser.convention;
  writer.quantity("range_min", convention.range_min, Quantity::length);
  writer.quantity("range_max", convention.range_max, Quantity::length);
  writer.line("no_return", format_sentinel(convention.no_return, convention.no_return_value));
  writer.line("too_close", format_sentinel(convention.too_close, convention.too_close_value));
  writer.word("stamp_beam", kStampBeamNames.at(static_cast<std::size_t>(laser.stamp_beam)));
  writer.integer("passes", laser.passes);
  writer.quantity("pass_period", laser.pass_period, Quantity::time);
  writer.quantity("beam_interval", laser.beam_interval, Quantity::time);
  writer.quantity("scan_period", laser.scan_period, Quantity::time);
  writer.quantity("noise_sigma", laser.noise_sigma, Quantity::length);
  writer.quantity("quantization", laser.quantization, Quantity::length);
  write_noise(writer, laser);
  writer.number("intensity_scale", laser.intensity_scale);
  writer.flag("intensities", laser.intensities);
  writer.integer("beams", laser.beams);
  writer.quantity("angle_min", laser.angle_min, Quantity::angle);
  writer.quantity("angle_increment", laser.angle_increment, Quantity::angle);
  if (!laser.source.empty()) writer.text("source", laser.source);
}

}  // namespace parhelion::yaml

#include "protocols/scenario_site.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion {
namespace {

using yaml::Node;
using yaml::Quantity;

std::vector<Eigen::Vector2d> rectangle(const Node& box) {
  const Eigen::Vector2d center = yaml::vector2(*box.find("center")), size = yaml::vector2(*box.find("size"));
  double yaw = 0;
  yaml::read(box, "yaw", yaw);
  const Eigen::Vector2d along = Eigen::Vector2d(std::cos(yaw), std::sin(yaw)) * size.x() / 2;
  const Eigen::Vector2d across = Eigen::Vector2d(-std::sin(yaw), std::cos(yaw)) * size.y() / 2;
  return {center - along - across, center + along - across, center + along + across, center - along + across};
}

Zone read_zone(const Node& node, yaml::Problems& problems) {
  Zone zone;
  yaml::read(node, "name", zone.name);
  yaml::read(node, "bottom", zone.bottom);
  yaml::read(node, "top", zone.top);
  const Node *outline = node.find("outline"), *box = node.find("box");
  if ((outline == nullptr) == (box == nullptr)) {
    problems.add(node.line, "zone '" + yaml::printable(zone.name) +
                                "': expected either an outline, such as 'outline: [[0 m, 0 m], [1 m, 0 m], "
                                "[1 m, 1 m]]', or a box");
    return zone;
  }
  if (box != nullptr) zone.outline = rectangle(*box);
  for (std::size_t i = 0; outline != nullptr && i < outline->items.size(); ++i)
    zone.outline.push_back(yaml::vector2(outline->items[i]));
  if (const Status status = check_zone(zone); !status) problems.add(node.line, status.error().message);
  return zone;
}

const std::array<const char*, 3> kHazardNames{to_string(HazardKind::device), to_string(HazardKind::radiation),
                                              to_string(HazardKind::gas)};

void read_optional(const Node& node, std::string_view key, std::optional<double>& out) {
  if (node.find(key) != nullptr) yaml::read(node, key, out.emplace());
}

Hazard read_hazard(const Node& node, yaml::Problems& problems) {
  Hazard hazard;
  yaml::read(node, "name", hazard.name);
  yaml::read(node, "kind", kHazardNames, hazard.kind);
  if (const Node* position = node.find("position")) hazard.position = yaml::vector3(*position);
  yaml::read(node, "agent", hazard.agent);
  if ((node.find("position") == nullptr) == hazard.agent.empty())
    problems.add(node.line, "hazard '" + yaml::printable(hazard.name) + "': expected a position or an agent");
  read_optional(node, "shock", hazard.shock);
  read_optional(node, "tilt", hazard.tilt);
  read_optional(node, "nearness", hazard.nearness);
  read_optional(node, "delay", hazard.delay);
  const char* strength = hazard.kind == HazardKind::gas ? "concentration" : "dose_rate";
  yaml::read(node, strength, hazard.strength);
  yaml::read(node, "half_value", hazard.half_value);
  yaml::read(node, "reach", hazard.reach);
  const bool source = hazard.kind != HazardKind::device;
  if (source && node.find(strength) == nullptr) {
    problems.add(node.line, "hazard '" + yaml::printable(hazard.name) + "': expected its '" + strength + "'");
  } else if (const Status status = check(hazard); !status) {
    problems.add(node.line, status.error().message);
  }
  return hazard;
}

void write(const Hazard& hazard, yaml::Writer& writer) {
  const auto write_optional = [&](std::string_view key, const std::optional<double>& value,
                                  Quantity quantity) {
    if (value) writer.quantity(key, *value, quantity);
  };
  writer.begin_item();
  writer.text("name", hazard.name);
  writer.word("kind", to_string(hazard.kind));
  if (hazard.agent.empty()) {
    writer.line("position", yaml::format_lengths(hazard.position.data(), 3));
  } else {
    writer.text("agent", hazard.agent);
  }
  if (hazard.kind == HazardKind::device) {
    write_optional("shock", hazard.shock, Quantity::impulse);
    write_optional("tilt", hazard.tilt, Quantity::angle);
    write_optional("nearness", hazard.nearness, Quantity::length);
    write_optional("delay", hazard.delay, Quantity::time);
  } else if (hazard.kind == HazardKind::radiation) {
    writer.quantity("dose_rate", hazard.strength, Quantity::dose_rate);
    writer.quantity("half_value", hazard.half_value, Quantity::length);
  } else {
    writer.quantity("concentration", hazard.strength, Quantity::concentration);
    writer.quantity("reach", hazard.reach, Quantity::length);
  }
  writer.end_item();
}

/// Rejects duplicate names.
template <class Named>
void check_names(const std::vector<Named>& all, const Node& list, const char* what,
                 yaml::Problems& problems) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (all[k].name != all[i].name) continue;
      problems.add(list.items[i].line,
                   std::string(what) + " '" + yaml::printable(all[i].name) + "' is a duplicate");
      break;
    }
  }
}

}  // namespace

std::vector<Zone> read_zones(const Node& list, yaml::Problems& problems) {
  std::vector<Zone> zones;
  for (const Node& item : list.items) zones.push_back(read_zone(item, problems));
  check_names(zones, list, "zone", problems);
  return zones;
}

void write_zones(const std::vector<Zone>& zones, yaml::Writer& writer) {
  if (zones.empty()) return;
  writer.open("zones");
  for (const Zone& zone : zones) {
    writer.begin_item();
    writer.text("name", zone.name);
    writer.open("outline");
    for (const Eigen::Vector2d& corner : zone.outline) writer.item(yaml::format_lengths(corner.data(), 2));
    writer.close();
    writer.quantity("bottom", zone.bottom, Quantity::length);
    writer.quantity("top", zone.top, Quantity::length);
    writer.end_item();
  }
  writer.close();
}

std::vector<Hazard> read_hazards(const Node& list, yaml::Problems& problems) {
  std::vector<Hazard> hazards;
  for (const Node& item : list.items) hazards.push_back(read_hazard(item, problems));
  check_names(hazards, list, "hazard", problems);
  return hazards;
}

void write_hazards(const std::vector<Hazard>& hazards, yaml::Writer& writer) {
  if (hazards.empty()) return;
  writer.open("hazards");
  for (const Hazard& hazard : hazards) write(hazard, writer);
  writer.close();
}

HazardSensor read_hazard_sensor(const Node& node, yaml::Problems& problems) {
  HazardSensor sensor;
  yaml::read(node, "radiation_lag", sensor.radiation_lag);
  yaml::read(node, "radiation_counts", sensor.radiation_counts);
  yaml::read(node, "gas_lag", sensor.gas_lag);
  yaml::read(node, "gas_noise", sensor.gas_noise);
  if (const Status status = check(sensor); !status) problems.add(node.line, status.error().message);
  return sensor;
}

void write(const HazardSensor& sensor, yaml::Writer& writer) {
  writer.open("hazard_sensor");
  writer.quantity("radiation_lag", sensor.radiation_lag, Quantity::time);
  writer.quantity("radiation_counts", sensor.radiation_counts, Quantity::rate);
  writer.quantity("gas_lag", sensor.gas_lag, Quantity::time);
  writer.quantity("gas_noise", sensor.gas_noise, Quantity::concentration);
  writer.close();
}

namespace {

void read_dose_limit(const Node& node, const char* key, DoseLimits::Limit& limit) {
  const Node* entry = node.find(key);
  if (entry == nullptr) return;
  for (auto [name, value] : {std::pair{"warning", &limit.warning}, std::pair{"limit", &limit.limit}})
    if (const Node* given = entry->find(name)) *value = given->number;
}

void write(const DoseLimits::Limit& limit, const char* key, Quantity quantity, yaml::Writer& writer) {
  if (!limit.warning && !limit.limit) return;
  writer.open(key);
  if (limit.warning) writer.quantity("warning", *limit.warning, quantity);
  if (limit.limit) writer.quantity("limit", *limit.limit, quantity);
  writer.close();
}

}  // namespace

DoseLimits read_dose_limits(const Node& node, yaml::Problems& problems) {
  DoseLimits limits;
  read_dose_limit(node, "radiation", limits.radiation);
  read_dose_limit(node, "gas", limits.gas);
  if (const Status status = check(limits); !status) problems.add(node.line, status.error().message);
  return limits;
}

void write(const DoseLimits& limits, yaml::Writer& writer) {
  writer.open("dose_limits");
  write(limits.radiation, "radiation", Quantity::dose, writer);
  write(limits.gas, "gas", Quantity::gas_dose, writer);
  writer.close();
}

Radio read_radio(const Node& node, yaml::Problems& problems) {
  Radio radio;
  radio.position = yaml::vector3(*node.find("position"));
  yaml::read(node, "power", radio.power);
  yaml::read(node, "frequency", radio.frequency);
  yaml::read(node, "exponent", radio.exponent);
  yaml::read(node, "wall_loss", radio.wall_loss);
  yaml::read(node, "sensitivity", radio.sensitivity);
  yaml::read(node, "restore", radio.restore);
  if (const Status status = check(radio); !status) problems.add(node.line, status.error().message);
  return radio;
}

void write(const Radio& radio, yaml::Writer& writer) {
  writer.open("radio");
  writer.line("position", yaml::format_lengths(radio.position.data(), 3));
  writer.quantity("power", radio.power, Quantity::power_level);
  writer.quantity("frequency", radio.frequency, Quantity::rate);
  writer.number("exponent", radio.exponent);
  writer.quantity("wall_loss", radio.wall_loss, Quantity::loss);
  writer.quantity("sensitivity", radio.sensitivity, Quantity::power_level);
  writer.quantity("restore", radio.restore, Quantity::loss);
  writer.close();
}

Battery read_battery(const Node& node, yaml::Problems& problems) {
  Battery battery;
  yaml::read(node, "capacity", battery.capacity);
  yaml::read(node, "idle", battery.idle);
  yaml::read(node, "efficiency", battery.efficiency);
  yaml::read(node, "rolling", battery.rolling);
  yaml::read(node, "low", battery.low);
  yaml::read(node, "charge", battery.charge);
  if (const Status status = check(battery); !status) problems.add(node.line, status.error().message);
  return battery;
}

void write(const Battery& battery, yaml::Writer& writer) {
  writer.open("battery");
  writer.quantity("capacity", battery.capacity, Quantity::energy);
  writer.quantity("idle", battery.idle, Quantity::power);
  writer.number("efficiency", battery.efficiency);
  writer.number("rolling", battery.rolling);
  writer.number("low", battery.low);
  writer.number("charge", battery.charge);
  writer.close();
}

}  // namespace parhelion

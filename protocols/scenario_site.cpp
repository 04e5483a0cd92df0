#include "protocols/scenario_site.hpp"

#include <cmath>
#include <string>

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

/// Each name once.
template <class Named>
void check_names(const std::vector<Named>& all, const Node& list, const char* what,
                 yaml::Problems& problems) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (all[k].name != all[i].name) continue;
      problems.add(list.items[i].line,
                   std::string(what) + " '" + yaml::printable(all[i].name) + "' is there twice");
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

}  // namespace parhelion

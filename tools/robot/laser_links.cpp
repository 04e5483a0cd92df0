#include "tools/robot/laser_links.hpp"

#include <algorithm>
#include <cctype>
#include <numbers>

#include "protocols/channel_map.hpp"
#include "protocols/nearest_name.hpp"
#include "tools/robot/dialogue.hpp"

namespace parhelion::tools {
namespace {

constexpr double kOneLaser = 0.1;     // m: links that are nearer are parts of one laser
constexpr std::size_t kMaxName = 16;  // see sensor_name_fault()

}  // namespace

std::optional<LaserPlace> read_laser_place(const UrdfOutline& urdf, const std::string& text) {
  if (text == "-") return std::nullopt;
  if (const auto link = urdf.T_base_link.find(text); link != urdf.T_base_link.end())
    return LaserPlace{text, link->second};
  const auto numbers = comma_separated(text);
  if (!numbers || (numbers->size() != 3 && numbers->size() != 4)) {
    throw WrongAnswer{"the URDF has no link '" + text + "'" + suggestion(text, urdf.links) +
                      "; of a laser that is no link give the position: x,y,z or x,y,z,yaw in m and degrees"};
  }
  LaserPlace place;
  place.T_base_laser.translation() = Eigen::Vector3d((*numbers)[0], (*numbers)[1], (*numbers)[2]);
  if (numbers->size() == 4) {
    const double yaw = (*numbers)[3] * std::numbers::pi / 180;
    place.T_base_laser.rotate(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  }
  return place;
}

std::vector<LaserPlace> likely_lasers(const UrdfOutline& urdf, const std::vector<LaserPlace>& taken) {
  std::vector<LaserPlace> known = taken, likely;
  for (const std::string& link : links_named(urdf, {"scan", "laser", "hokuyo", "sick", "lidar"})) {
    const LaserPlace place{link, urdf.T_base_link.at(link)};
    const bool is_known = std::any_of(known.begin(), known.end(), [&](const LaserPlace& each) {
      return (each.T_base_laser.translation() - place.T_base_laser.translation()).norm() < kOneLaser;
    });
    if (is_known) continue;
    known.push_back(place);
    likely.push_back(place);
  }
  return likely;
}

std::string laser_name(const std::string& link, std::size_t number) {
  std::string name, word;
  const auto end_part = [&] {
    constexpr const char* usual[] = {"laser", "lidar", "scan", "scanner", "hokuyo", "sick",
                                     "link",  "frame", "base", "mount",   "2d"};
    if (!word.empty() && std::find(std::begin(usual), std::end(usual), word) == std::end(usual))
      name += (name.empty() ? "" : "_") + word;
    word.clear();
  };
  for (const char c : link) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) {
      end_part();
    } else {
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  end_part();
  if (name.size() > kMaxName) name.resize(kMaxName);
  return name.empty() || !sensor_name_fault(name).empty() ? "laser" + std::to_string(number) : name;
}

}  // namespace parhelion::tools

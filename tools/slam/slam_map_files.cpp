#include <cstdio>

#include "fusion/semantic/pictures/plan_picture.hpp"
#include "tools/import/gzip_file.hpp"
#include "tools/slam/slam_log.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

Status draw_map(const pose::GridMap& map, const std::string& name, const std::string& file) {
  semantic::PlanPicture picture;
  picture.title = "Map " + name;
  char text[128];
  std::snprintf(text, sizeof text, "%.1f x %.1f m, %g m a cell, id %.12s", map.width * map.resolution,
                map.height * map.resolution, map.resolution, map.id.c_str());
  picture.subtitle = text;
  picture.map = &map;
  semantic::PlanPath path{"path driven", {31, 111, 235}, {}};
  for (const Eigen::Vector3d& pose : map.path) path.points.emplace_back(pose.head<2>());
  picture.paths.push_back(std::move(path));
  return semantic::draw_plan(picture, file);
}

std::vector<std::string> file_names(const std::string& name) {
  return {name + ".simplemap", name + ".pgm", name + ".yaml", name + ".png"};
}

}  // namespace

std::string joined_map_files(const std::filesystem::path& prefix) {
  std::string text;
  for (const std::string& name : file_names(prefix.string())) text += (text.empty() ? "" : ", ") + name;
  return text;
}

Status check_map_files(const std::filesystem::path& prefix, bool overwrite) {
  if (prefix.empty()) return {};
  for (const std::string& file : file_names(prefix.filename().string())) {
    if (const Status free = check_writable(prefix.parent_path() / file, overwrite); !free) return free;
  }
  return {};
}

Status save_map_files(const pose::Slam& slam, const std::filesystem::path& prefix, bool overwrite) {
  if (const Status free = check_map_files(prefix, overwrite); !free) return free;
  const std::string name = prefix.filename().string();
  return write_beside(prefix, file_names(name), [&](const std::filesystem::path& folder) -> Status {
    const std::string part = (folder / name).string();
    if (Status saved = slam.save_simplemap(part + ".simplemap"); !saved) return saved;
    // MRPT does not check that its last bytes reach the disk.
    if (!GzipFile::intact(part + ".simplemap"))
      return Error{prefix.string() + ".simplemap: could not be written completely: is the disk full?"};
    const pose::GridMap map = slam.grid_map();
    if (Status saved = pose::save_ros_map(map, part); !saved) return saved;
    return draw_map(map, name, part + ".png");
  });
}

}  // namespace parhelion::tools

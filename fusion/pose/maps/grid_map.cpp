// ROS map files: map_server's YAML and PGM (wiki.ros.org/map_server, trinary).
#include "fusion/pose/maps/grid_map.hpp"

#include <yaml-cpp/yaml.h>

#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocols/sha256.hpp"

namespace parhelion::pose {
namespace {

constexpr double kOccupiedThreshold = 0.65, kFreeThreshold = 0.196;  ///< map_server's defaults
constexpr std::uint8_t kPgmOccupied = 0, kPgmUnknown = 205, kPgmFree = 254;
constexpr long kMaxCells = 400'000'000;
constexpr double kFarthest = 1e6;  ///< m

std::uint8_t trinary(float occupied) {
  const auto p = static_cast<double>(occupied);
  return p > kOccupiedThreshold ? kPgmOccupied : p < kFreeThreshold ? kPgmFree : kPgmUnknown;
}

std::string exact(double v) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), v);
  return {text.data(), end.ptr};
}

struct Pgm {
  int width = 0, height = 0, max_value = 255;
  std::vector<std::uint8_t> pixels;
};

/// The next number of a PGM header; comments run from '#' to the end of the line.
std::optional<int> header_number(const std::string& bytes, std::size_t& at) {
  while (at < bytes.size()) {
    if (bytes[at] == '#') {
      at = bytes.find('\n', at);
      if (at == std::string::npos) return std::nullopt;
    } else if (std::isspace(static_cast<unsigned char>(bytes[at])) == 0) {
      break;
    }
    ++at;
  }
  int number = 0;
  const auto [end, failed] = std::from_chars(bytes.data() + at, bytes.data() + bytes.size(), number);
  if (failed != std::errc{} || number < 0) return std::nullopt;
  at = static_cast<std::size_t>(end - bytes.data());
  return number;
}

Result<Pgm> read_pgm(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{path + ": cannot be opened"};
  std::ostringstream content;
  content << file.rdbuf();
  const std::string bytes = content.str();
  if (bytes.size() < 2 || bytes.compare(0, 2, "P5") != 0) {
    return Error{path +
                 ": offset 0: expected a binary PGM ('P5'); convert the image, for instance with `convert "
                 "map.png map.pgm`"};
  }
  std::size_t at = 2;
  const auto width = header_number(bytes, at), height = header_number(bytes, at),
             max_value = header_number(bytes, at);
  if (!width || !height || !max_value || *width < 1 || *height < 1 || *max_value < 1 || *max_value > 255 ||
      static_cast<long>(*width) * *height > kMaxCells) {
    return Error{path + ": offset " + std::to_string(at) +
                 ": expected width, height (1 or more) and a maximum of 1..255"};
  }
  ++at;  // one white-space character between header and pixels
  const std::size_t size = static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height);
  if (bytes.size() < at + size) {
    return Error{path + ": offset " + std::to_string(bytes.size()) + ": the file ends, expected " +
                 std::to_string(at + size) + " bytes for " + std::to_string(*width) + " x " +
                 std::to_string(*height) + " pixels"};
  }
  Pgm pgm{*width, *height, *max_value, std::vector<std::uint8_t>(size)};
  std::memcpy(pgm.pixels.data(), bytes.data() + at, size);
  return pgm;
}

struct MapHeader {
  std::string image;
  int image_line = 1;
  double resolution = 0, x = 0, y = 0, yaw = 0;
  double occupied = kOccupiedThreshold, free = kFreeThreshold;
  bool negate = false;
};

Result<MapHeader> read_header(const std::string& path) {
  const auto fail = [&path](const YAML::Mark& mark, const std::string& what) {
    return Error{path + ":" + std::to_string(mark.line + 1) + ": " + what};
  };
  MapHeader header;
  try {
    const YAML::Node root = YAML::LoadFile(path);
    if (!root.IsMap())
      return fail(root.Mark(), "expected a map of image, resolution and origin, as map_server writes it");
    for (const char* key : {"image", "resolution", "origin"}) {
      if (!root[key])
        return fail(
            root.Mark(),
            std::string("'") + key +
                "' is missing; expected image, resolution and origin, as in the YAML file of a ROS map");
    }
    header.image = root["image"].as<std::string>();
    header.image_line = root["image"].Mark().line + 1;
    header.resolution = root["resolution"].as<double>();
    if (!(header.resolution > 0 && header.resolution < 10)) {
      return fail(root["resolution"].Mark(),
                  "'resolution': expected m per cell, above 0 and below 10, found '" +
                      root["resolution"].Scalar() + "'");
    }
    const YAML::Node origin = root["origin"];
    if (!origin.IsSequence() || origin.size() < 2)
      return fail(origin.Mark(), "origin must be [x, y, yaw], m and rad");
    header.x = origin[0].as<double>();
    header.y = origin[1].as<double>();
    header.yaw = origin.size() > 2 ? origin[2].as<double>() : 0;
    if (!(std::abs(header.x) <= kFarthest && std::abs(header.y) <= kFarthest))
      return fail(origin.Mark(), "origin must be at most 1000 km from the map's frame");
    if (header.yaw != 0)
      return fail(origin.Mark(), "a rotated origin (yaw other than 0) is not supported: rotate the image");
    if (root["negate"]) header.negate = root["negate"].as<int>() != 0;
    if (root["occupied_thresh"]) header.occupied = root["occupied_thresh"].as<double>();
    if (root["free_thresh"]) header.free = root["free_thresh"].as<double>();
    if (!(header.free >= 0 && header.free <= header.occupied && header.occupied <= 1)) {
      return fail(root.Mark(), "expected 0 <= free_thresh <= occupied_thresh <= 1");
    }
    if (root["mode"] && root["mode"].as<std::string>() != "trinary") {
      return fail(root["mode"].Mark(),
                  "mode '" + root["mode"].as<std::string>() + "' is not supported, expected 'trinary'");
    }
  } catch (const YAML::BadFile&) {
    return Error{path + ": cannot be opened; expected a ROS map YAML file"};
  } catch (const YAML::BadConversion& error) {
    return fail(error.mark,
                "expected text for image and mode, 0 or 1 for negate, and numbers for resolution, origin "
                "and the thresholds");
  } catch (const YAML::Exception& error) {
    return fail(error.mark, error.msg);
  }
  return header;
}

}  // namespace

std::string grid_map_id(const GridMap& map) {
  Sha256 hash;
  std::string geometry = "parhelion grid " + std::to_string(map.width) + " " + std::to_string(map.height) +
                         " " + exact(map.resolution) + " " + exact(map.x_min) + " " + exact(map.y_min) + "\n";
  hash.add({reinterpret_cast<const std::uint8_t*>(geometry.data()), geometry.size()});
  std::vector<std::uint8_t> cells;
  cells.reserve(map.occupied.size());
  for (const float p : map.occupied) cells.push_back(trinary(p));
  hash.add(cells);
  return hash.hex();
}

Status save_ros_map(const GridMap& map, const std::string& prefix) {
  if (map.width < 1 || map.height < 1 ||
      map.occupied.size() != static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height)) {
    return Error{prefix + ".pgm: an empty map cannot be saved: was there any scan?"};
  }
  std::ofstream pgm(prefix + ".pgm", std::ios::binary);
  pgm << "P5\n# " << exact(map.resolution) << " m/cell\n" << map.width << " " << map.height << "\n255\n";
  for (int y = map.height - 1; y >= 0; --y) {
    for (int x = 0; x < map.width; ++x) {
      pgm.put(static_cast<char>(
          trinary(map.occupied[static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) +
                               static_cast<std::size_t>(x)])));
    }
  }
  std::ofstream yaml(prefix + ".yaml");
  yaml << "image: " << std::filesystem::path(prefix).filename().string()
       << ".pgm\nresolution: " << exact(map.resolution) << "\norigin: [" << exact(map.x_min) << ", "
       << exact(map.y_min) << ", 0]\nnegate: 0\noccupied_thresh: " << exact(kOccupiedThreshold)
       << "\nfree_thresh: " << exact(kFreeThreshold) << "\nmode: trinary\n";
  if (!pgm.flush() || !yaml.flush()) {
    return Error{
        prefix +
        ".yaml, .pgm: could not be written: does the directory exist and is there room on the disk?"};
  }
  return {};
}

Result<GridMap> load_ros_map(const std::string& yaml_path) {
  const auto header = read_header(yaml_path);
  if (!header) return header.error();
  const std::filesystem::path image = std::filesystem::path(yaml_path).parent_path() / header->image;
  const auto pgm = read_pgm(image.string());
  if (!pgm)
    return Error{yaml_path + ":" + std::to_string(header->image_line) + ": 'image': " + pgm.error().message};
  GridMap map;
  map.resolution = header->resolution;
  map.x_min = header->x, map.y_min = header->y;
  map.width = pgm->width, map.height = pgm->height;
  map.occupied.resize(pgm->pixels.size());
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const auto w = static_cast<std::size_t>(map.width);
      const std::uint8_t pixel =
          pgm->pixels[static_cast<std::size_t>(map.height - 1 - y) * w + static_cast<std::size_t>(x)];
      const double white = static_cast<double>(pixel) / pgm->max_value;
      const double p = header->negate ? white : 1 - white;
      map.occupied[static_cast<std::size_t>(y) * w + static_cast<std::size_t>(x)] = p > header->occupied
                                                                                        ? 1.0F
                                                                                    : p < header->free ? 0.0F
                                                                                                       : 0.5F;
    }
  }
  map.id = grid_map_id(map);
  return map;
}

}  // namespace parhelion::pose

#include "tools/import/rgbd_folder.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "tools/import/image_files.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kYear2000 = 946'684'800;  // s since the epoch

std::optional<double> to_number(std::string_view word) {
  double value = 0;
  if (word.starts_with("+")) word.remove_prefix(1);
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Normalizes a rotation that was rounded in a file. Error: far from a rotation.
Result<Eigen::Isometry3d> rigid(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  constexpr double tolerance = 0.02;
  const bool finite = rotation.allFinite() && translation.allFinite();
  if (!finite || (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm() > tolerance ||
      rotation.determinant() < 0) {
    return Error{"not a rigid pose"};
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  pose.translation() = translation;
  return pose;
}

/// The 16 numbers of a pose file, row by row. Error: it is cut off, or has something else.
Result<Eigen::Matrix4d> read_matrix(const fs::path& path) {
  const auto numbers = read_numbers(path);
  if (!numbers) return numbers.error();
  if (numbers->size() != 16) {
    return Error{path.string() + ": " + std::to_string(numbers->size()) +
                 " numbers; a 4x4 matrix is expected"};
  }
  return Eigen::Matrix4d(Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers->data()));
}

struct FrameFiles {
  fs::path colour, depth, pose;
};

std::map<std::uint64_t, FrameFiles> seven_scenes_frames(const fs::path& folder) {
  static const std::regex name("frame-([0-9]{1,9})\\.(color|depth|pose)\\.(png|jpg|jpeg|txt)");
  std::map<std::uint64_t, FrameFiles> frames;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string file = entry.path().filename().string();
    std::smatch match;
    if (!std::regex_match(file, match, name)) continue;
    FrameFiles& frame = frames[std::stoull(match[1])];
    (match[2] == "color" ? frame.colour : match[2] == "depth" ? frame.depth : frame.pose) = entry.path();
  }
  return frames;
}

RgbdFolder read_seven_scenes(const ImportOptions& options) {
  RgbdFolder folder;
  for (const auto& [number, files] : seven_scenes_frames(options.input)) {
    const auto us = std::llround(static_cast<double>(number) / options.frame_rate * 1e6);
    const SensorTime stamp = SensorTime::from_utime(kYear2000 * 1'000'000 + us);
    if (!files.colour.empty()) folder.colour.push_back({stamp, files.colour, number});
    if (!files.depth.empty()) folder.depth.push_back({stamp, files.depth, number});
    if (files.pose.empty()) continue;
    const std::string place = "frame " + std::to_string(number);
    const auto matrix = read_matrix(files.pose);
    if (!matrix) {
      folder.damaged.push_back({place, matrix.error().message});
      continue;
    }
    const auto pose = rigid(matrix->topLeftCorner<3, 3>(), matrix->topRightCorner<3, 1>());
    if (pose) {
      folder.poses.push_back({stamp, *pose, number});
    } else {
      folder.refused.push_back(
          {place, files.pose.string() + ": " + pose.error().message + "; camera to world, 4x4, is expected"});
    }
  }
  folder.notes.push_back("frames are numbered, not stamped: number / " + std::to_string(options.frame_rate) +
                         " s after 2000-01-01");
  return folder;
}

/// Lines of a TUM list: words of each, without comments.
std::vector<std::pair<std::uint64_t, std::vector<std::string>>> list_lines(const fs::path& path) {
  std::vector<std::pair<std::uint64_t, std::vector<std::string>>> lines;
  std::ifstream file(path);
  std::string line;
  for (std::uint64_t number = 1; std::getline(file, line); ++number) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::vector<std::string> list;
    for (std::string word; words >> word;) list.push_back(word);
    if (!list.empty()) lines.emplace_back(number, std::move(list));
  }
  return lines;
}

std::optional<SensorTime> tum_stamp(const std::string& word) {
  const auto seconds_since_epoch = to_number(word);
  constexpr double latest = 9.2e9;
  if (!seconds_since_epoch || !(*seconds_since_epoch >= 0 && *seconds_since_epoch < latest))
    return std::nullopt;
  return SensorTime::from_utime(std::llround(*seconds_since_epoch * 1e6));
}

std::vector<RgbdFile> read_tum_images(const fs::path& path, const char* list, RgbdFolder& folder) {
  std::vector<RgbdFile> files;
  std::map<SensorTime, std::uint64_t> line_of;
  for (const auto& [number, words] : list_lines(path / list)) {
    const std::string place = list + std::string(":") + std::to_string(number);
    const auto stamp = words.size() == 2 ? tum_stamp(words[0]) : std::nullopt;
    if (!stamp) {
      folder.damaged.push_back({place, "'timestamp filename' is expected"});
      continue;
    }
    const auto [first, is_new] = line_of.emplace(*stamp, number);
    if (is_new)
      files.push_back({*stamp, path / words[1], number});
    else
      folder.refused.push_back({place, "the timestamp of line " + std::to_string(first->second) + " again"});
  }
  return files;
}

std::vector<RgbdPose> read_tum_poses(const fs::path& path, RgbdFolder& folder) {
  std::vector<RgbdPose> poses;
  for (const auto& [number, words] : list_lines(path / "groundtruth.txt")) {
    std::array<double, 8> v{};
    bool good = words.size() == v.size();
    for (std::size_t i = 0; good && i < v.size(); ++i) {
      const auto value = to_number(words[i]);
      good = value.has_value();
      v[i] = value.value_or(0);
    }
    const Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
    const auto stamp = good && std::abs(q.norm() - 1) < 0.01 ? tum_stamp(words[0]) : std::nullopt;
    const auto pose = rigid(q.normalized().toRotationMatrix(), {v[1], v[2], v[3]});
    if (stamp && pose) {
      poses.push_back({*stamp, *pose, number});
    } else {
      // Where motion capture has lost the camera some lists have "nan".
      (good ? folder.refused : folder.damaged)
          .push_back(
              {"groundtruth.txt:" + std::to_string(number), "'timestamp tx ty tz qx qy qz qw' is expected"});
    }
  }
  return poses;
}

RgbdFolder read_tum(const ImportOptions& options) {
  RgbdFolder folder;
  folder.layout = RgbdFolder::Layout::tum;
  folder.colour = read_tum_images(options.input, "rgb.txt", folder);
  folder.depth = read_tum_images(options.input, "depth.txt", folder);
  folder.poses = read_tum_poses(options.input, folder);
  folder.depth_units_per_metre = 5000;
  folder.down = Eigen::Vector3d(0, 0, -1);
  const auto earlier = [](const auto& a, const auto& b) { return a.stamp < b.stamp; };
  std::stable_sort(folder.colour.begin(), folder.colour.end(), earlier);
  std::stable_sort(folder.depth.begin(), folder.depth.end(), earlier);
  std::stable_sort(folder.poses.begin(), folder.poses.end(), earlier);
  folder.notes.push_back("TUM layout: depth registered to colour, 5000 a metre, world z up");
  return folder;
}

Eigen::Vector2i size_of_first(const std::vector<RgbdFile>& files, bool depth, double units) {
  for (const RgbdFile& file : files) {
    auto bytes = read_file(file.path.string());
    if (!bytes) continue;
    if (depth) {
      const auto pixels = read_depth_png(*bytes, units);
      if (pixels) return {pixels->width, pixels->height};
    } else {
      const auto image = colour_image(std::move(*bytes), file.stamp);
      if (image) return {image->width, image->height};
    }
  }
  return {0, 0};
}

Error unknown_layout(const fs::path& folder) {
  std::string sequences;
  std::error_code ignored;
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.is_directory() && !seven_scenes_frames(entry.path()).empty())
      names.push_back(entry.path().string());
  }
  std::sort(names.begin(), names.end());
  for (const std::string& name : names) sequences += "\n  " + name;
  if (!sequences.empty())
    return Error{folder.string() + ": holds several sequences; name one of them:" + sequences};
  return Error{folder.string() +
               ": no RGB-D frames: frame-000000.depth.png and so on (7-Scenes), or rgb.txt and "
               "depth.txt (TUM) are expected"};
}

}  // namespace

fs::path find_beside(const fs::path& folder, const char* name) {
  const fs::path whole = fs::absolute(folder / "").lexically_normal().parent_path();
  for (const fs::path& place : {whole, whole.parent_path()}) {
    if (fs::exists(place / name)) return place / name;
  }
  return {};
}

Result<std::vector<double>> read_numbers(const fs::path& path) {
  std::vector<double> numbers;
  if (!fs::exists(path)) return Error{path.string() + ": no such file"};
  for (const auto& [line, words] : list_lines(path)) {
    for (const std::string& word : words) {
      const auto value = to_number(word);
      if (!value) {
        return Error{path.string() + ":" + std::to_string(line) + ": '" + word.substr(0, 40) +
                     "' is not a number"};
      }
      numbers.push_back(*value);
    }
  }
  return numbers;
}

Result<RgbdFolder> read_rgbd_folder(const ImportOptions& options) {
  const bool tum = fs::exists(options.input / "depth.txt") || fs::exists(options.input / "rgb.txt");
  RgbdFolder folder = tum ? read_tum(options) : read_seven_scenes(options);
  if (folder.depth.empty() && folder.colour.empty()) return unknown_layout(options.input);
  auto cameras =
      read_rgbd_cameras(options.input, folder.layout, size_of_first(folder.colour, false, 1),
                        size_of_first(folder.depth, true, folder.depth_units_per_metre), folder.notes);
  if (!cameras) return cameras.error();
  folder.cameras = std::move(*cameras);
  if (const fs::path gravity = find_beside(options.input, "gravity-direction.txt"); !gravity.empty()) {
    const auto direction = read_numbers(gravity);
    if (!direction) return direction.error();
    if (direction->size() != 3 || Eigen::Map<const Eigen::Vector3d>(direction->data()).norm() < 0.5) {
      return Error{gravity.string() + ": a unit vector that points down is expected"};
    }
    folder.down = Eigen::Map<const Eigen::Vector3d>(direction->data()).normalized();
  }
  return folder;
}

std::optional<Eigen::Isometry3d> pose_at(const std::vector<RgbdPose>& poses, SensorTime stamp) {
  constexpr Duration farthest = milliseconds(100);
  const auto after = std::lower_bound(poses.begin(), poses.end(), stamp,
                                      [](const RgbdPose& pose, SensorTime t) { return pose.stamp < t; });
  if (after == poses.end()) return std::nullopt;
  if (after->stamp == stamp) return after->T_world_depth;
  if (after == poses.begin()) return std::nullopt;
  const RgbdPose& before = *(after - 1);
  if (after->stamp - before.stamp > farthest) return std::nullopt;
  const double s = (stamp - before.stamp).seconds() / (after->stamp - before.stamp).seconds();
  using Between = Transform<Map, DepthOptical>;
  return interpolate(Between(before.T_world_depth), Between(after->T_world_depth), s).isometry();
}

}  // namespace parhelion::tools

// Calibration beside RGB-D frames: camera-intrinsics.txt, and kapture's sensors and rigs
// (https://github.com/naver/kapture/blob/main/kapture_format.adoc).
#include <charconv>
#include <fstream>

#include "tools/import/rgbd_folder.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;

struct KaptureSensor {
  std::string id, type;
  CameraIntrinsics intrinsics;
  Eigen::Isometry3d T_sensor_rig = Eigen::Isometry3d::Identity();
};

struct Row {
  std::string place;
  std::vector<std::string> cells;
};

std::vector<Row> csv_rows(const fs::path& path) {
  std::vector<Row> rows;
  std::ifstream file(path);
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    Row row{path.string() + ":" + std::to_string(number), {}};
    for (std::size_t at = 0; at <= line.size();) {
      const std::size_t comma = std::min(line.find(',', at), line.size());
      std::string cell = line.substr(at, comma - at);
      cell.erase(0, cell.find_first_not_of(" \t\r"));
      cell.erase(cell.find_last_not_of(" \t\r") + 1);
      row.cells.push_back(std::move(cell));
      at = comma + 1;
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

Result<std::vector<double>> numbers(const Row& row, std::size_t first, std::size_t count) {
  std::vector<double> values;
  for (std::size_t i = first; i < first + count; ++i) {
    double value = 0;
    const std::string cell = i < row.cells.size() ? row.cells[i] : std::string();
    const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (cell.empty() || code != std::errc() || end != cell.data() + cell.size()) {
      return Error{row.place + ": column " + std::to_string(i + 1) + " is '" + cell.substr(0, 40) +
                   "', expected a number"};
    }
    values.push_back(value);
  }
  return values;
}

/// model, width, height, parameters: COLMAP's camera models, as used by kapture.
Result<CameraIntrinsics> camera_model(const Row& row) {
  const std::string model = row.cells.size() > 3 ? row.cells[3] : std::string();
  const std::map<std::string, std::size_t> parameters = {{"SIMPLE_PINHOLE", 5}, {"PINHOLE", 6},
                                                         {"SIMPLE_RADIAL", 6},  {"RADIAL", 7},
                                                         {"OPENCV", 10},        {"OPENCV_FISHEYE", 10}};
  const auto known = parameters.find(model);
  if (known == parameters.end()) {
    return Error{
        row.place + ": camera model '" + model.substr(0, 40) +
        "' is not known here; SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV or OPENCV_FISHEYE is "
        "expected"};
  }
  const auto v = numbers(row, 4, known->second);
  if (!v) return v.error();
  CameraIntrinsics camera;
  camera.width = static_cast<int>((*v)[0]);
  camera.height = static_cast<int>((*v)[1]);
  const bool one_focal_length = model.starts_with("SIMPLE") || model == "RADIAL";
  camera.fx = (*v)[2];
  camera.fy = (*v)[one_focal_length ? 2 : 3];
  const std::size_t centre = one_focal_length ? 3 : 4;
  camera.cx = (*v)[centre];
  camera.cy = (*v)[centre + 1];
  for (std::size_t i = centre + 2; i < v->size(); ++i) camera.distortion[i - centre - 2] = (*v)[i];
  if (model == "OPENCV_FISHEYE") camera.lens = CameraIntrinsics::Lens::fisheye;
  return camera;
}

Result<std::vector<KaptureSensor>> read_kapture(const fs::path& sensors_file, const fs::path& rigs_file) {
  std::vector<KaptureSensor> sensors;
  for (const Row& row : csv_rows(sensors_file)) {
    if (row.cells.size() < 3 || (row.cells[2] != "camera" && row.cells[2] != "depth")) continue;
    const auto intrinsics = camera_model(row);
    if (!intrinsics) return intrinsics.error();
    sensors.push_back({row.cells[0], row.cells[2], *intrinsics, Eigen::Isometry3d::Identity()});
  }
  if (rigs_file.empty()) return sensors;
  for (const Row& row : csv_rows(rigs_file)) {
    const auto v = numbers(row, 2, 7);
    if (!v) return v.error();
    const Eigen::Quaterniond q((*v)[0], (*v)[1], (*v)[2], (*v)[3]);
    if (std::abs(q.norm() - 1) > 0.01)
      return Error{row.place + ": a quaternion qw, qx, qy, qz of length 1 is expected"};
    for (KaptureSensor& sensor : sensors) {
      if (sensor.id != row.cells[1]) continue;
      sensor.T_sensor_rig.linear() = q.normalized().toRotationMatrix();
      sensor.T_sensor_rig.translation() = Eigen::Vector3d((*v)[4], (*v)[5], (*v)[6]);
    }
  }
  return sensors;
}

/// Kapture lists the depth camera and, as "..._reg", the depth camera registered to colour.
const KaptureSensor* choose(const std::vector<KaptureSensor>& sensors, const std::string& type) {
  const KaptureSensor* chosen = nullptr;
  for (const KaptureSensor& sensor : sensors) {
    if (sensor.type == type && (chosen == nullptr || chosen->id.ends_with("_reg"))) chosen = &sensor;
  }
  return chosen;
}

CameraIntrinsics pinhole(double fx, double fy, double cx, double cy, Eigen::Vector2i size) {
  CameraIntrinsics camera;
  camera.width = size.x();
  camera.height = size.y();
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = cx;
  camera.cy = cy;
  return camera;
}

Status check_size(const CameraIntrinsics& camera, Eigen::Vector2i size, const char* what) {
  if (size.x() == 0 || (camera.width == size.x() && camera.height == size.y())) return {};
  return Error{std::string(what) + " images are " + std::to_string(size.x()) + "x" +
               std::to_string(size.y()) + ", their calibration is for " + std::to_string(camera.width) + "x" +
               std::to_string(camera.height)};
}

Result<RgbdCameras> from_kapture(const fs::path& sensors_file, const fs::path& rigs_file,
                                 Eigen::Vector2i colour_size, Eigen::Vector2i depth_size) {
  const auto sensors = read_kapture(sensors_file, rigs_file);
  if (!sensors) return sensors.error();
  const KaptureSensor* colour = choose(*sensors, "camera");
  const KaptureSensor* depth = choose(*sensors, "depth");
  if (colour == nullptr || depth == nullptr) {
    return Error{sensors_file.string() + ": a sensor of type camera and one of type depth are expected"};
  }
  for (const Status& fits : {check_size(colour->intrinsics, colour_size, "colour"),
                             check_size(depth->intrinsics, depth_size, "depth")}) {
    if (!fits.ok()) return Error{sensors_file.string() + ": " + fits.error().message};
  }
  RgbdCameras cameras{colour->intrinsics, depth->intrinsics, Eigen::Isometry3d::Identity(), {}};
  cameras.T_depth_colour = depth->T_sensor_rig * colour->T_sensor_rig.inverse();
  cameras.source = "colour " + colour->id + " and depth " + depth->id + " of " +
                   sensors_file.filename().string() +
                   (rigs_file.empty() ? "" : " and " + rigs_file.filename().string());
  return cameras;
}

}  // namespace

Result<RgbdCameras> read_rgbd_cameras(const fs::path& folder, RgbdFolder::Layout layout,
                                      Eigen::Vector2i colour_size, Eigen::Vector2i depth_size,
                                      std::vector<std::string>& notes) {
  const fs::path sensors = find_beside(folder, "kapture_sensors.txt");
  if (!sensors.empty()) {
    return from_kapture(sensors, find_beside(folder, "kapture_rigs.txt"), colour_size, depth_size);
  }
  RgbdCameras cameras;
  const fs::path file = find_beside(folder, "camera-intrinsics.txt");
  if (!file.empty()) {
    const auto k = read_numbers(file);
    if (!k) return k.error();
    if (k->size() != 9 || !((*k)[0] > 0) || !((*k)[4] > 0)) {
      return Error{file.string() + ": a 3x3 camera matrix is expected"};
    }
    cameras.depth = pinhole((*k)[0], (*k)[4], (*k)[2], (*k)[5], depth_size);
    cameras.source = file.filename().string();
  } else if (layout == RgbdFolder::Layout::tum) {
    cameras.depth = pinhole(525, 525, 319.5, 239.5, depth_size);
    cameras.source = "TUM's default calibration, f 525";
    notes.push_back("no calibration beside the frames: TUM's default, f 525, c 319.5 239.5, is assumed");
  } else {
    cameras.depth = pinhole(585, 585, 320, 240, depth_size);
    cameras.source = "7-Scenes' nominal depth calibration, f 585";
    notes.push_back(
        "no calibration beside the frames: 7-Scenes' nominal depth camera, f 585, c 320 240, is assumed");
  }
  cameras.colour = cameras.depth;
  cameras.colour.width = colour_size.x();
  cameras.colour.height = colour_size.y();
  if (colour_size.x() > 0 && depth_size.x() > 0 && colour_size != depth_size) {
    return Error{folder.string() +
                 ": colour and depth images differ in size, and the pose of one camera relative to the "
                 "other is not given; expected kapture_sensors.txt and kapture_rigs.txt"};
  }
  if (layout == RgbdFolder::Layout::seven_scenes) {
    notes.push_back("no transform between colour and depth: assumed registered");
  }
  return cameras;
}

}  // namespace parhelion::tools

// Small valid files of every kind that the program reads, and their readers, for the test over mutated files.
#pragma once

#include <bzlib.h>
#include <lz4frame.h>
#include <mrpt/io/CFileGZOutputStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>
#include <zlib.h>

#include <opencv2/imgcodecs.hpp>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/write_cloud.hpp"
#include "fusion/pose/maps/frozen_map.hpp"
#include "fusion/pose/maps/mapped_scan.hpp"
#include "tests/mutation.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/written_bag.hpp"

namespace parhelion::test {

// ---- Recordings of other systems
// ----------------------------------------------------------------------------

inline MutationSample import_sample(const TemporaryFolder& folder, const std::filesystem::path& input,
                                    std::vector<std::filesystem::path> files) {
  auto options = import_options(input, folder / "out.lcm");
  options.overwrite = true;
  return {std::move(files), [options] { return status_of(tools::import_recording(options, {})); }};
}

inline MutationSample import_sample(const TemporaryFolder& folder, const std::string& name) {
  return import_sample(folder, folder / name, {folder / name});
}

inline std::string gunzipped(const std::filesystem::path& path) {
  std::string bytes(std::size_t{1} << 20U, '\0');
  gzFile file = gzopen(path.c_str(), "rb");
  bytes.resize(
      static_cast<std::size_t>(std::max(0, gzread(file, bytes.data(), static_cast<unsigned>(bytes.size())))));
  gzclose(file);
  return bytes;
}

inline void write_gzip(const std::filesystem::path& path, const std::string& bytes) {
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
}

inline std::string bzip2(const std::string& text) {
  std::string bytes = text;
  std::string packed(bytes.size() + bytes.size() / 100 + 600, '\0');
  auto size = static_cast<unsigned>(packed.size());
  BZ2_bzBuffToBuffCompress(packed.data(), &size, bytes.data(), static_cast<unsigned>(bytes.size()), 1, 0, 0);
  packed.resize(size);
  return packed;
}

inline std::string lz4(const std::string& bytes) {
  std::string packed(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
  packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  return packed;
}

inline mrpt::obs::CObservation2DRangeScan::Ptr mrpt_scan(double t) {
  auto scan = mrpt::obs::CObservation2DRangeScan::Create();
  scan->timestamp = mrpt::Clock::fromDouble(1e9 + t);
  scan->aperture = 2.0F;
  scan->maxRange = 10;
  scan->sensorLabel = "FRONT";
  scan->resizeScan(20);
  for (std::size_t i = 0; i < 20; ++i) {
    scan->setScanRange(i, 2.0F + 0.1F * static_cast<float>(i));
    scan->setScanRangeValidity(i, true);
  }
  return scan;
}

/// Three scans with odometry in `path`, gzipped by MRPT.
inline void write_rawlog(const std::filesystem::path& path, bool paired) {
  mrpt::io::CFileGZOutputStream file(path.string());
  auto archive = mrpt::serialization::archiveFrom(file);
  for (int i = 0; i < 3; ++i) {
    if (paired) {
      mrpt::obs::CActionRobotMovement2D moved;
      moved.timestamp = mrpt::Clock::fromDouble(1e9 + i);
      moved.computeFromOdometry(mrpt::poses::CPose2D(0.1, 0, 0.01), {});
      mrpt::obs::CActionCollection actions;
      actions.insert(moved);
      mrpt::obs::CSensoryFrame frame;
      frame.insert(mrpt_scan(i));
      archive << actions << frame;
    } else {
      mrpt::obs::CObservationOdometry odometry;
      odometry.timestamp = mrpt::Clock::fromDouble(1e9 + i);
      odometry.odometry = {0.1 * i, 0, 0};
      archive << odometry << *mrpt_scan(i);
    }
  }
}

/// Inflated unless `packed`, so that damage reaches the objects; both are read.
inline MutationSample rawlog_sample(const TemporaryFolder& folder, bool paired, bool packed) {
  write_rawlog(folder / "in.rawlog", paired);
  if (!packed) replace_file(folder / "in.rawlog", gunzipped(folder / "in.rawlog"));
  return import_sample(folder, "in.rawlog");
}

inline std::string carmen_text() {
  std::string text = "# CARMEN log\nPARAM robot_front_laser_max 81.9\n";
  for (int i = 0; i < 5; ++i) {
    const std::string t = std::to_string(100 + i);
    text += "ODOM 1.0 2.0 0.5 0 0 0 " + t + ".25 host " + t + ".25\n";
    text += "FLASER 4 1.5 2.5 3.5 81.83 1.3 2.0 0.0 1.0 2.0 0.0 " + t + ".5 host " + t + ".5\n";
  }
  return text;
}

/// With the newer kind of laser line.
inline std::string carmen_robotlaser_text() {
  std::string text;
  for (int i = 0; i < 5; ++i) {
    const std::string t = std::to_string(100 + i);
    text += "ROBOTLASER1 0 -1.5 3.1 0.03 81.9 0.01 0 4 1 2 3 4 0 1 2 0 1 2 0 0 0 0 0 0 " + t + ".6 host " +
            t + ".6\n";
  }
  return text;
}

inline RosBytes ros_transform(const std::string& parent, const std::string& child) {
  RosBytes bytes;
  bytes.add(std::uint32_t{1})
      .header(100, 0, parent)
      .text(child)
      .doubles({0.3, 0.1, 1.2, -0.5, 0.5, -0.5, 0.5});
  return bytes;
}

inline RosBytes ros_camera_info() {
  RosBytes bytes;
  bytes.header(100, 0, "camera").add(std::uint32_t{4}).add(std::uint32_t{6}).text("plumb_bob");
  bytes.array<double>({0.1, -0.2, 0.003, 0.004, 0.05});
  bytes.doubles({500, 0, 3.25, 0, 501, 1.75, 0, 0, 1}).doubles({1, 0, 0, 0, 1, 0, 0, 0, 1});
  bytes.doubles({490, 0, 3, 0, 0, 491, 2, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) bytes.add(std::uint32_t{0});
  bytes.add(std::uint8_t{0});
  return bytes;
}

/// A message of each kind that is imported.
inline WrittenBag small_bag() {
  WrittenBag bag;
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100, ros_transform("base_link", "camera"));
  bag.add("/tf_static", "tf2_msgs/TFMessage", 100, ros_transform("base_link", "laser"));
  bag.add("/camera/camera_info", "sensor_msgs/CameraInfo", 100, ros_camera_info());
  RosBytes image;
  image.header(100, 2000, "camera").add(std::uint32_t{4}).add(std::uint32_t{6}).text("bgr8");
  image.add(std::uint8_t{0}).add(std::uint32_t{18}).array(std::vector<std::uint8_t>(72, 9));
  bag.add("/camera/image_raw", "sensor_msgs/Image", 101, image);
  RosBytes depth;
  depth.header(100, 3000, "camera").add(std::uint32_t{4}).add(std::uint32_t{6}).text("16UC1");
  depth.add(std::uint8_t{0}).add(std::uint32_t{12}).array(std::vector<std::uint8_t>(48, 3));
  bag.add("/depth/image", "sensor_msgs/Image", 101, depth);
  for (std::uint32_t i = 0; i < 3; ++i) {
    RosBytes scan, odometry, imu, joints;
    scan.header(102 + i, 1000, "laser");
    for (const float value : {-1.0F, 1.0F, 0.5F, 0.0F, 0.1F, 0.2F, 30.0F}) scan.add(value);
    scan.array<float>({1, 2, 3, 4, 5}).array<float>({10, 20, 30, 40, 50});
    bag.add("/scan", "sensor_msgs/LaserScan", 102 + i, scan);
    odometry.header(102 + i, 1000, "odom").text("base_link").doubles({0.1 * i, 0, 0, 0, 0, 0, 1});
    for (int zero = 0; zero < 36 + 6 + 36; ++zero) odometry.add(0.0);
    bag.add("/odom", "nav_msgs/Odometry", 102 + i, odometry);
    imu.header(102 + i, 1000, "base_link").doubles({0, 0, 0, 1});
    for (int zero = 0; zero < 9 + 3 + 9 + 3 + 9; ++zero) imu.add(0.0);
    bag.add("/imu", "sensor_msgs/Imu", 102 + i, imu);
    joints.header(102 + i, 1000, "").add(std::uint32_t{1}).text("arm");
    joints.array<double>({0.5}).array<double>({0}).array<double>({0});
    bag.add("/joint_states", "sensor_msgs/JointState", 102 + i, joints);
  }
  return bag;
}

inline void write_picture(const std::filesystem::path& path) {
  cv::Mat bgr(240, 320, CV_8UC3);
  for (int row = 0; row < bgr.rows; ++row)
    for (int column = 0; column < bgr.cols; ++column)
      bgr.at<cv::Vec3b>(row, column) =
          cv::Vec3b(static_cast<std::uint8_t>(column), 90, static_cast<std::uint8_t>(row));
  cv::imwrite(path.string(), bgr);
}

constexpr double kDepthFocus = 262;  // px, of a camera of 320 x 240 pixels

/// A floor 1 m below a level camera, and a wall 3 m ahead.
inline void write_depth(const std::filesystem::path& path, double units_per_metre) {
  cv::Mat depth(240, 320, CV_16UC1);
  for (int row = 0; row < depth.rows; ++row) {
    const double down = (row - 119.5) / kDepthFocus;
    const double z = down > 0 ? std::min(3.0, 1 / down) : 3.0;
    depth.row(row).setTo(std::lround(z * units_per_metre));
  }
  cv::imwrite(path.string(), depth);
}

/// A 7-Scenes folder of two frames; `files`: what may be damaged.
inline std::filesystem::path write_seven_scenes(const TemporaryFolder& folder,
                                                std::vector<std::filesystem::path>& files) {
  const std::filesystem::path place = folder / "scenes";
  std::filesystem::create_directories(place);
  for (const char* frame : {"frame-000000", "frame-000001"}) {
    const std::string stem = (place / frame).string();
    write_picture(stem + ".color.png");
    write_depth(stem + ".depth.png", 1000);
    write_text(stem + ".pose.txt", "1 0 0 0.5\n0 0 1 0\n0 -1 0 1\n0 0 0 1\n");
    for (const char* end : {".color.png", ".depth.png", ".pose.txt"}) files.emplace_back(stem + end);
  }
  write_text(place / "camera-intrinsics.txt", "262 0 159.5\n0 262 119.5\n0 0 1\n");
  write_text(place / "gravity-direction.txt", "0 0 -1\n");
  files.push_back(place / "camera-intrinsics.txt");
  files.push_back(place / "gravity-direction.txt");
  return place;
}

inline MutationSample seven_scenes_sample(const TemporaryFolder& folder) {
  std::vector<std::filesystem::path> files;
  const std::filesystem::path place = write_seven_scenes(folder, files);
  return import_sample(folder, place, files);
}

inline MutationSample tum_sample(const TemporaryFolder& folder) {
  const std::filesystem::path place = folder / "tum";
  std::filesystem::create_directories(place);
  write_picture(place / "1.png");
  write_depth(place / "2.png", 5000);
  write_text(place / "camera-intrinsics.txt", "262 0 159.5\n0 262 119.5\n0 0 1\n");
  write_text(place / "rgb.txt", "# colour\n1305031102.16 1.png\n1305031102.20 1.png\n");
  write_text(place / "depth.txt", "# depth\n1305031102.16 2.png\n1305031102.20 2.png\n");
  write_text(place / "groundtruth.txt",
             "1305031102.16 0.5 0.25 1 -0.5 0.5 -0.5 0.5\n1305031102.21 0.5 0.25 1 -0.5 0.5 -0.5 0.5\n");
  return import_sample(
      folder, place,
      {place / "rgb.txt", place / "depth.txt", place / "groundtruth.txt", place / "1.png", place / "2.png"});
}

// ---- Maps and clouds
// ----------------------------------------------------------------------------------------

inline MutationSample simplemap_sample(const TemporaryFolder& folder, bool packed) {
  pose::MappedScan mapped;
  mapped.scan.angle_min = -1;
  mapped.scan.angle_increment = 0.05F;
  mapped.scan.ranges.assign(40, 5);
  const std::string path = folder / "map.simplemap";
  EXPECT_TRUE(pose::write_simplemap(std::vector<pose::MappedScan>(3, mapped), path).ok());
  if (!packed) replace_file(path, gunzipped(path));
  return {{path}, [path] { return status_of(pose::load_frozen_map(path, 0.05)); }};
}

inline MutationSample ros_map_sample(const TemporaryFolder& folder) {
  pose::GridMap map;
  map.width = 40, map.height = 30;
  map.resolution = 0.05;
  for (int i = 0; i < map.width * map.height; ++i) map.occupied.push_back(i % 7 == 0 ? 1.0F : 0.0F);
  map.id = pose::grid_map_id(map);
  EXPECT_TRUE(pose::save_ros_map(map, folder / "map").ok());
  const std::string path = folder / "map.yaml";
  return {{path, folder / "map.pgm"}, [path] { return status_of(pose::load_frozen_map(path, 0.05)); }};
}

inline MutationSample cloud_sample(const std::string& path) {
  return {{path}, [path] { return status_of(cloud::read_scan(path)); }};
}

inline cloud::PointCloud<Scanner> small_cloud() {
  cloud::PointCloud<Scanner> cloud;
  for (int i = 0; i < 40; ++i) {
    const auto x = static_cast<float>(i);
    cloud.points.emplace_back(0.1F * x, -x, 2.0F);
    cloud.normals.push_back(Eigen::Vector3f::UnitZ());
    cloud.colours.push_back({static_cast<std::uint8_t>(i), 0, 9});
  }
  cloud.viewpoints.emplace_back(1, 2, 3);
  return cloud;
}

inline MutationSample written_cloud_sample(const TemporaryFolder& folder, const char* end) {
  const std::string path = folder / (std::string("cloud") + end);
  const bool ply = std::string(end) == ".ply";
  EXPECT_TRUE((ply ? cloud::write_ply(path, small_cloud()) : cloud::write_pcd(path, small_cloud())).ok());
  return cloud_sample(path);
}

inline MutationSample ply_text_sample(const TemporaryFolder& folder) {
  write_text(folder / "cloud.ply",
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
             "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
             "1 2 3\n-4 5.5 6\n0 0 -1\n3 0 1 2\n");
  return cloud_sample(folder / "cloud.ply");
}

/// Compressed as literals only, or text.
inline MutationSample pcd_sample(const TemporaryFolder& folder, bool packed) {
  const std::string head =
      "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\n";
  RosBytes columns, literals, data;
  for (const float value : {1.0F, -4.0F, 0.0F, 2.0F, 5.5F, 0.0F, 3.0F, 6.0F, -1.0F}) columns.add(value);
  literals.add(std::uint8_t{31}).raw(columns.bytes().substr(0, 32));
  literals.add(std::uint8_t{3}).raw(columns.bytes().substr(32));
  data.add(static_cast<std::uint32_t>(literals.bytes().size())).add(std::uint32_t{36}).raw(literals.bytes());
  write_text(folder / "cloud.pcd", packed ? head + "DATA binary_compressed\n" + data.bytes()
                                          : head + "DATA ascii\n1 2 3\n-4 5.5 6\n0 0 -1\n");
  return cloud_sample(folder / "cloud.pcd");
}

inline MutationSample uos_sample(const TemporaryFolder& folder) {
  write_text(folder / "scan000.3d", "a heading\n-200 300 100 17\n-550 600 -400 3\n0 -100 0 255\n");
  write_text(folder / "scan000.pose", "10 20 30\n1 2 3\n");
  MutationSample sample = cloud_sample(folder / "scan000.3d");
  sample.files.emplace_back(folder / "scan000.pose");
  return sample;
}

}  // namespace parhelion::test

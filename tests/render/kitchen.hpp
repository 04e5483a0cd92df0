// The recording rgbd-7scenes-redkitchen-a as render jobs: a hand-held Kinect over a kitchen table and a
// slatted chair. Its attribution file gives the pose between colour and depth camera and the floor's height.
#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/recordings.hpp"
#include "tests/render/scenes.hpp"

namespace parhelion::test {

struct Kitchen {
  std::filesystem::path folder = recording("rgbd-7scenes-redkitchen-a");
  Eigen::Isometry3d T_map_world = Eigen::Isometry3d::Identity();  ///< map: z against gravity, floor at 0
  CameraDescription colour;
  DepthCameraDescription depth;
  Eigen::Isometry3d T_colour_depth = Eigen::Isometry3d::Identity();

  Kitchen() {
    Eigen::Vector3d down;
    std::ifstream gravity(folder / "gravity-direction.txt");
    for (int i = 0; i < 3; ++i) gravity >> down[i];
    const Eigen::Quaterniond level =
        Eigen::Quaterniond::FromTwoVectors(down.normalized(), -Eigen::Vector3d::UnitZ());
    T_map_world.linear() = level.toRotationMatrix();
    T_map_world.translation() =
        Eigen::Vector3d(0, 0, 1.48);  // the floor lies 1.48 m below the world's origin
    colour = pinhole(640, 480, 525);
    colour.intrinsics.cx = 320, colour.intrinsics.cy = 240;
    depth.intrinsics = colour.intrinsics;
    depth.intrinsics.fx = depth.intrinsics.fy = 585;
    depth.range_min = 0.4, depth.range_max = 8;
    // kapture_rigs.txt, sensor kinect_rgb: transforms points of the rig (the depth camera) to the colour
    // camera.
    T_colour_depth.linear() = Eigen::Quaterniond(-0.9999829690719851, -0.004080640735846227,
                                                 0.00394659107519435, 0.0013543840101732576)
                                  .toRotationMatrix();
    T_colour_depth.translation() =
        Eigen::Vector3d(-0.025558943178152542, 0.00010109636268061706, 0.002031832172948704);
  }

  bool there() const { return std::filesystem::exists(folder / "frame-000000.color.jpg"); }

  std::vector<std::uint8_t> bytes(const std::string& name) const {
    std::ifstream file(folder / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// Frame 0 to 99 (every second one of the original) with the bodies of `world`.
  render::RenderJob job(int frame, const WorldSnapshot& world) const {
    char stem[32];
    std::snprintf(stem, sizeof stem, "frame-%06d", 2 * frame);
    Eigen::Isometry3d T_world_depth = Eigen::Isometry3d::Identity();
    std::ifstream pose(folder / (std::string(stem) + ".pose.txt"));
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c) pose >> T_world_depth.matrix()(r, c);
    render::RenderJob job;
    job.image.stamp = SensorTime::from_utime(1'000'000 + frame * 66'667);
    job.image.width = 640, job.image.height = 480;
    job.image.bytes = bytes(std::string(stem) + ".color.jpg");
    job.camera = colour;
    job.depth = Image{};
    job.depth->stamp = job.image.stamp;
    job.depth->width = 640, job.depth->height = 480;
    job.depth->format = PixelFormat::depth_mm;
    job.depth->bytes = bytes(std::string(stem) + ".depth.png");
    job.depth->metadata = {{"encoding", {'p', 'n', 'g'}}};
    job.depth_camera = depth;
    job.T_map_depth =
        Transform<Map, DepthOptical>({Eigen::Quaterniond((T_map_world * T_world_depth).linear()),
                                      (T_map_world * T_world_depth).translation()});
    job.T_map_optical =
        job.T_map_depth * Transform<DepthOptical, CameraOptical>(T_colour_depth.inverse(Eigen::Isometry));
    job.world = world;
    return job;
  }

  /// m, intersection of the ray through a pixel of frame `frame` with the floor.
  Eigen::Vector3d floor_point(int frame, double u, double v) const {
    const Transform<Map, CameraOptical> T = job(frame, {}).T_map_optical;
    const Eigen::Vector3d ray = T.rotation() * Eigen::Vector3d((u - 320) / 525, (v - 240) / 525, 1);
    return T.translation() - ray * (T.translation().z() / ray.z());
  }
};

}  // namespace parhelion::test

// Small worlds, cameras and images for the tests of this module.
#pragma once

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "render/compositor.hpp"
#include "render/jpeg.hpp"

namespace parhelion::test {

inline Shape shape(ShapeKind kind, const Eigen::Vector3d& size,
                   const Eigen::Vector3d& position = Eigen::Vector3d::Zero(),
                   const Eigen::Vector3f& albedo = {0.5F, 0.3F, 0.1F}, double roll = 0) {
  Shape s;
  s.kind = kind;
  s.size = size;
  s.T_body_shape = {Eigen::Quaterniond(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX())), position};
  s.material.albedo = albedo;
  s.material.roughness = 0.4F;
  return s;
}

/// A body of the world, on its own scene list.
struct World {
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
  WorldSnapshot snapshot;

  void add(const std::string& entity, std::vector<Shape> shapes, const Transform<Map, Body>& T_map_body,
           BodyOwner owner = BodyOwner::agent, bool injectable = true) {
    auto body = std::make_shared<BodyDefinition>();
    body->id = static_cast<BodyId>(scene->bodies.size() + 1);
    body->entity = entity;
    body->owner = owner;
    body->injectable = injectable;
    body->shapes = std::move(shapes);
    scene->bodies.push_back(body);
    BodyState state;
    state.id = body->id;
    state.T_map_body = T_map_body;
    snapshot.bodies.push_back(state);
    snapshot.scene = scene;
  }
};

/// A four-wheeled robot with mast and lidar, on the floor at z = 0: about 2,000 triangles near by.
inline std::vector<Shape> robot_shapes(const Eigen::Vector3f& colour = {0.7F, 0.25F, 0.05F}) {
  std::vector<Shape> shapes = {
      shape(ShapeKind::box, {0.50, 0.36, 0.16}, {0, 0, 0.17}, colour),
      shape(ShapeKind::box, {0.30, 0.30, 0.10}, {-0.05, 0, 0.30}, {0.08F, 0.08F, 0.09F}),
      shape(ShapeKind::cylinder, {0.05, 0.05, 0.08}, {0.12, 0, 0.39}, {0.1F, 0.1F, 0.12F}),
      shape(ShapeKind::cylinder, {0.02, 0.02, 0.35}, {-0.15, 0, 0.5}, {0.5F, 0.5F, 0.5F}),
      shape(ShapeKind::sphere, {0.05, 0.05, 0.05}, {-0.15, 0, 0.7}, {0.9F, 0.1F, 0.05F}),
  };
  for (const double x : {-0.16, 0.16})
    for (const double y : {-0.2, 0.2})
      shapes.push_back(
          shape(ShapeKind::cylinder, {0.10, 0.10, 0.07}, {x, y, 0.10}, {0.03F, 0.03F, 0.03F}, M_PI / 2));
  return shapes;
}

/// A camera at `eye` that looks along yaw, `pitch` radians downwards.
inline Transform<Map, CameraOptical> look(const Eigen::Vector3d& eye, double yaw, double pitch) {
  Eigen::Matrix3d R;
  R.col(2) =
      Eigen::Vector3d(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), -std::sin(pitch));
  R.col(0) = Eigen::Vector3d(std::sin(yaw), -std::cos(yaw), 0);
  R.col(1) = R.col(2).cross(R.col(0));
  return {Eigen::Quaterniond(R), eye};
}

inline CameraDescription pinhole(int width = 640, int height = 480, double f = 525) {
  CameraDescription camera;
  camera.intrinsics.width = width, camera.intrinsics.height = height;
  camera.intrinsics.fx = camera.intrinsics.fy = f;
  camera.intrinsics.cx = 0.5 * (width - 1), camera.intrinsics.cy = 0.5 * (height - 1);
  return camera;
}

inline ModelEntity wall(const std::string& name, double x, double y, double yaw, double length,
                        double height = 2.5, EntityLabel label = EntityLabel::wall) {
  ModelEntity entity;
  entity.name = name;
  entity.label = label;
  entity.T_map_body = Transform<Map, Body>::planar(x, y, yaw, 0.5 * height);
  entity.size = {length, 0.12, height};
  return entity;
}

/// Seeded noise over a gradient: a picture in which every changed byte is visible.
inline std::vector<std::uint8_t> noise(std::size_t bytes, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> pixels(bytes);
  for (std::size_t i = 0; i < bytes; ++i)
    pixels[i] = static_cast<std::uint8_t>((i / 3 % 200) + random() % 50);
  return pixels;
}

inline Image raw_image(PixelFormat format, int width = 640, int height = 480, int padding = 0) {
  Image image;
  image.stamp = SensorTime::from_utime(1'000'000);
  image.width = width, image.height = height;
  image.format = format;
  image.row_stride = width * (format == PixelFormat::gray ? 1 : 3) + padding;
  image.bytes = noise(static_cast<std::size_t>(image.row_stride) * static_cast<std::size_t>(height));
  return image;
}

inline Image jpeg_image(
    int width = 640, int height = 480, int quality = 85,
    render::JpegFormat::Subsampling subsampling = render::JpegFormat::Subsampling::yuv420) {
  render::JpegCodec codec;
  std::vector<std::uint8_t> bgr(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < bgr.size(); ++i)
    bgr[i] = static_cast<std::uint8_t>(90 + i / 3 % static_cast<std::size_t>(width) / 8 + i % 3 * 20);
  Image image;
  image.stamp = SensorTime::from_utime(1'000'000);
  image.width = width, image.height = height;
  image.bytes = codec.encode(bgr, {width, height, quality, subsampling}).value();
  image.metadata = {{"exposure", {'7'}}};
  return image;
}

/// A corridor with a robot 3 m ahead of the camera.
inline render::RenderJob robot_job(Image image, double distance = 3) {
  World world;
  world.add("red", robot_shapes(), Transform<Map, Body>::planar(distance, 0, 0.6));
  render::RenderJob job;
  job.image = std::move(image);
  job.camera = pinhole();
  job.T_map_optical = look({0, 0, 0.9}, 0, 0.15);
  job.world = world.snapshot;
  return job;
}

}  // namespace parhelion::test

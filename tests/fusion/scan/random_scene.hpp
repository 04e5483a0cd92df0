// Seeded sweeps, bodies and buildings for comparing a caster with its reference.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "fusion/scan/augment.hpp"

namespace parhelion::test {

/// Draws from a seeded Mersenne twister with its own arithmetic: the same numbers with any standard library.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  std::uint64_t word() { return engine_(); }
  double real(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  int integer(int low, int high) {
    return low + static_cast<int>(engine_() % static_cast<unsigned>(high - low + 1));
  }
  bool chance(double p) { return real(0, 1) < p; }
  Eigen::Vector3d vector(double reach) {
    return {real(-reach, reach), real(-reach, reach), real(-reach, reach)};
  }
  /// A turn of at most `angle` about any axis.
  Eigen::Quaterniond rotation(double angle) {
    Eigen::Vector3d axis = vector(1);
    if (axis.norm() < 1e-6) axis = Eigen::Vector3d::UnitX();
    return Eigen::Quaterniond(Eigen::AngleAxisd(real(-angle, angle), axis.normalized()));
  }

 private:
  std::mt19937_64 engine_;
};

/// All inputs of one cast. `bodies` point into `definitions`.
struct RandomScene {
  scan::LaserMotion laser;
  scan::BeamSet beams;
  std::vector<float> time, angles;
  std::deque<BodyDefinition> definitions;
  std::vector<scan::BodyMotion> bodies;
  SemanticModel building;
  double max_range = 80;
};

inline Shape random_shape(Draw& draw) {
  Shape shape;
  shape.kind = static_cast<ShapeKind>(draw.integer(0, 3));
  const double largest = draw.chance(0.1) ? 8 : 1;
  shape.size = {draw.real(0.02, largest), draw.real(0.02, largest), draw.real(0.02, largest)};
  if (shape.kind != ShapeKind::box) shape.size.y() = shape.size.x();
  if (shape.kind == ShapeKind::sphere) shape.size.z() = shape.size.x();
  shape.T_body_shape = {draw.chance(0.3) ? Eigen::Quaterniond::Identity() : draw.rotation(3),
                        draw.vector(0.8)};
  shape.material.laser_reflectivity = static_cast<float>(draw.real(0, 1));
  return shape;
}

/// A pose near another one, one sweep later: occasionally far, or turned by almost half a turn.
template <class Frame>
Transform<Map, Frame> moved(Draw& draw, const Transform<Map, Frame>& from) {
  if (draw.chance(0.3)) return from;
  const double distance = draw.chance(0.1) ? 3 : 0.1, turn = draw.chance(0.1) ? 3 : 0.1;
  const Eigen::Quaterniond q =
      from.quaternion() *
      (draw.chance(0.5)
           ? draw.rotation(turn)
           : Eigen::Quaterniond(Eigen::AngleAxisd(draw.real(-turn, turn), Eigen::Vector3d::UnitZ())));
  return {q, from.translation() + draw.vector(distance)};
}

inline void random_beams(Draw& draw, int n, RandomScene& scene) {
  const double full = 2 * std::numbers::pi;
  const double field = draw.chance(0.2)   ? full
                       : draw.chance(0.1) ? draw.real(full, 2.5 * full)
                                          : draw.real(0.5, 4.8);
  const double sign = draw.chance(0.3) ? -1 : 1;
  scene.beams.angle_min = static_cast<float>(draw.chance(0.5) ? -sign * field / 2 : draw.real(-7, 7));
  scene.beams.angle_increment = static_cast<float>(sign * field / n);
  LaserDescription lidar;
  lidar.passes = draw.integer(1, 3);
  lidar.beam_interval = draw.chance(0.1) ? 0 : 37e-6;
  lidar.pass_period = 13.3e-3;
  scan::beam_times(lidar, static_cast<std::size_t>(n), scene.time);
  scene.beams.time = scene.time;
}

/// Moves each beam by up to two steps, so that some change their order.
inline void make_uneven(Draw& draw, RandomScene& scene) {
  const double step = scene.beams.angle_increment;
  for (std::size_t i = 0; i < scene.time.size(); ++i)
    scene.angles.push_back(static_cast<float>(scene.beams.angle(i) + draw.real(-2, 2) * step));
  scene.beams.angles = scene.angles;
}

inline ModelEntity random_wall(Draw& draw, const Eigen::Vector3d& middle, int index) {
  ModelEntity wall;
  wall.name = "wall " + std::to_string(index);
  wall.label = EntityLabel::wall;
  wall.size = {draw.real(0.1, 8), draw.real(0.02, 0.4), draw.real(0.5, 3)};
  // Drawn one by one: the order of evaluation of arguments is unspecified.
  const double z = draw.real(-2, 2), y = draw.real(-25, 25), x = draw.real(-25, 25);
  const Eigen::Vector3d offset(x, y, z);
  const Eigen::Quaterniond yaw(Eigen::AngleAxisd(draw.real(-4, 4), Eigen::Vector3d::UnitZ()));
  wall.T_map_body = {draw.chance(0.2) ? yaw * draw.rotation(1) : yaw, middle + offset};
  wall.is_virtual = draw.chance(0.1);
  wall.material.laser_reflectivity = static_cast<float>(draw.real(0, 1));
  return wall;
}

inline RandomScene random_scene(std::uint64_t seed, int beams, int bodies, int walls) {
  Draw draw(seed);
  RandomScene scene;
  // Sites with the map's origin far away are common (national grids).
  const Eigen::Vector3d middle = draw.vector(draw.chance(0.2) ? 20'000 : 20);
  const Eigen::Quaterniond level(Eigen::AngleAxisd(draw.real(-4, 4), Eigen::Vector3d::UnitZ()));
  const Eigen::Quaterniond q = draw.chance(0.5) ? level : level * draw.rotation(draw.chance(0.8) ? 0.3 : 3);
  scene.laser.T_map_laser_start = {q, middle};
  scene.laser.T_map_laser_end = moved(draw, scene.laser.T_map_laser_start);
  random_beams(draw, beams, scene);
  scene.max_range = draw.chance(0.2) ? draw.real(1, 8) : 80;
  for (int b = 0; b < bodies; ++b) {
    BodyDefinition& body = scene.definitions.emplace_back();
    body.id = static_cast<BodyId>(b + 1);
    for (int s = draw.integer(1, 4); s > 0; --s) body.shapes.push_back(random_shape(draw));
    // Most near the laser's plane; some on top of the laser.
    const double far = draw.chance(0.1) ? 0.5 : draw.chance(0.5) ? 6 : 30;
    const double z = draw.real(-0.8, 0.8), y = draw.real(-far, far), x = draw.real(-far, far);
    const Eigen::Vector3d offset(x, y, z);
    scan::BodyMotion motion{&body, {draw.rotation(3), middle + q * offset}, {}};
    motion.T_map_body_end = moved(draw, motion.T_map_body_start);
    scene.bodies.push_back(motion);
  }
  for (int w = 0; w < walls; ++w) scene.building.entities.push_back(random_wall(draw, middle, w));
  return scene;
}

}  // namespace parhelion::test

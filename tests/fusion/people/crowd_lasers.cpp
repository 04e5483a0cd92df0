#include "tests/fusion/people/crowd_lasers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
constexpr double kInf = std::numeric_limits<double>::infinity();

struct Hit {
  double range = kInf;
  const Shape* shape = nullptr;
};

Hit cast(const std::vector<Shape>& shapes, const Vector2d& o, const Vector2d& d, Random* random) {
  Hit nearest;
  for (const Shape& shape : shapes) {
    const double range = hit(shape, o, d);
    if (range < nearest.range && (shape.visible >= 1 || random == nullptr || random->chance(shape.visible)))
      nearest = {range, &shape};
  }
  return nearest;
}

}  // namespace

LaserDescription describe(const LaserKind& kind) {
  LaserDescription laser;
  laser.convention.range_min = static_cast<float>(kind.range_min);
  laser.convention.range_max = static_cast<float>(kind.range_max);
  laser.noise_sigma = kind.noise;
  laser.quantization = kind.quantization;
  laser.scan_period = 1 / kind.rate;
  laser.beams = kind.beams;
  laser.beam_interval = 0.9 / kind.rate / kind.beams;
  laser.angle_increment = kind.field / kind.beams * (kind.clockwise ? -1 : 1);
  laser.angle_min = -kind.field / 2 * (kind.clockwise ? -1 : 1);
  return laser;
}

void measure(const CrowdOptions& options, const LaserDescription& laser, World& world, CrowdScan& out) {
  constexpr int kParts = 8;  // the world moves during a sweep
  const int beams = options.laser.beams;
  out.scan.ranges.assign(static_cast<std::size_t>(beams), std::numeric_limits<float>::infinity());
  out.source.assign(out.scan.ranges.size(), Source::nothing);
  const std::size_t people = world.walkers().size();
  std::vector<int> counts(people, 0);
  std::vector<double> exact(out.scan.ranges.size(), kInf);
  std::vector<int> person(out.scan.ranges.size(), -1);
  for (int part = 0; part < kParts; ++part) {
    const Pose2 own = world.own();
    const Pose2 estimate = part == 0 || part == kParts - 1 ? world.estimate() : Pose2{};
    const auto T = transform<Map, Laser>(estimate).moved_by({0, 0, options.laser.height});
    if (part == 0) out.estimated.T_map_laser_start = T;
    if (part == kParts - 1) out.estimated.T_map_laser_end = T;
    if (part == kParts / 2) {
      out.T_map_laser = options.odometry ? own : Pose2{};
      const Pose2 T_map_true = out.T_map_laser * own.inverse();
      for (std::size_t i = 0; i < people; ++i) {
        const Walker& walker = world.walkers()[i];
        out.people.push_back({static_cast<int>(i), T_map_true * seen_at(walker), walker.velocity, 0});
      }
      for (const Rover& rover : world.rovers()) out.robots.push_back(T_map_true * rover.pose.position());
    }
    const std::vector<Shape> shapes = world.shapes();
    for (int i = beams * part / kParts; i < beams * (part + 1) / kParts; ++i) {
      const double angle = own.yaw + beam_angle(laser, i);
      const Hit nearest = cast(shapes, own.position(), {std::cos(angle), std::sin(angle)}, &world.random());
      const auto k = static_cast<std::size_t>(i);
      exact[k] = nearest.range;
      if (nearest.shape == nullptr) continue;
      out.source[k] = nearest.shape->source;
      person[k] = nearest.shape->person;
    }
    world.step(0.9 / options.laser.rate / kParts);
  }
  Random& random = world.random();
  for (std::size_t k = 0; k < exact.size(); ++k) {
    double range = exact[k];
    if (k > 0 && std::isfinite(exact[k - 1]) && std::isfinite(range) && std::abs(exact[k - 1] - range) < 2 &&
        std::abs(exact[k - 1] - range) > 0.1 && random.chance(options.laser.mixed))
      range += random.uniform(0, 1) * (exact[k - 1] - range);
    range += random.normal(options.laser.noise);
    if (options.laser.quantization > 0)
      range = std::round(range / options.laser.quantization) * options.laser.quantization;
    if (!(range < options.laser.range_max) || random.chance(options.laser.dropout)) {
      out.source[k] = Source::nothing;
      continue;
    }
    out.scan.ranges[k] = static_cast<float>(std::max(range, 0.0));
    if (person[k] >= 0) ++counts[static_cast<std::size_t>(person[k])];
  }
  for (std::size_t i = 0; i < people; ++i) out.people[i].beams = counts[i];
}

std::vector<scan::RangeHit> modelled_walls(const CrowdOptions& options, const LaserDescription& laser,
                                           const World& world, const scan::LaserMotion& estimated) {
  const Pose2 middle =
      interpolate(planar(estimated.T_map_laser_start), planar(estimated.T_map_laser_end), 0.5);
  std::vector<scan::RangeHit> building;
  for (int i = 0; i < options.laser.beams; ++i) {
    const double angle = middle.yaw + beam_angle(laser, i);
    const Hit wall = cast(world.walls(), middle.position(), {std::cos(angle), std::sin(angle)}, nullptr);
    building.push_back({static_cast<float>(wall.range < options.laser.range_max ? wall.range : kInf), -1, 0});
  }
  return building;
}

}  // namespace parhelion::test

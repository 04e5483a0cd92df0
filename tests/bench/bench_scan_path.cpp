// The scan path on the scene of the stated capacity: 361 beams, 80 m, 100 boxes and 50 moving robots of 20
// boxes each, 200 walls; its parts alone, and the exact reference implementation. p50 and p99 are over single
// scans.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <deque>
#include <numbers>
#include <random>

#include "fusion/scan/augment.hpp"
#include "fusion/scan/leaf_fit.hpp"
#include "protocols/quantile.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kBeams = 361;
constexpr double kMaxRange = 80;

class Draw {
 public:
  double real(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }

 private:
  std::mt19937_64 engine_{7};
};

LaserDescription lms200() {
  LaserDescription laser;
  laser.convention = {0.05F, 80, RangeConvention::Sentinel::value, 81.83F, RangeConvention::Sentinel::value,
                      0};
  laser.passes = 2;
  laser.pass_period = 1.0 / 75;
  laser.beam_interval = 1.0 / 75 / 360;
  laser.noise_sigma = 0.005;
  laser.quantization = 0.01;
  return laser;
}

Shape box(const Eigen::Vector3d& size, const Eigen::Vector3d& at, double yaw = 0) {
  Shape shape;
  shape.size = size;
  shape.T_body_shape = {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), at};
  return shape;
}

/// Chassis, wheels, mast, arms: 20 boxes, about half of them at the height of a laser at 0.3 m.
BodyDefinition robot() {
  BodyDefinition body;
  body.shapes.push_back(box({0.7, 0.5, 0.3}, {0, 0, 0.25}));
  for (int i = 0; i < 4; ++i)
    body.shapes.push_back(box({0.3, 0.08, 0.3}, {i < 2 ? 0.2 : -0.2, i % 2 ? 0.3 : -0.3, 0.15}));
  for (int i = 0; i < 15; ++i) {
    const double a = i * 0.42;
    body.shapes.push_back(box({0.1, 0.15, 0.2}, {0.3 * std::cos(a), 0.25 * std::sin(a), 0.1 + 0.07 * i}, a));
  }
  return body;
}

struct World {
  LaserDescription laser = lms200();
  std::vector<float> time;
  scan::Sweep sweep;
  scan::BeamSet beams;
  std::deque<BodyDefinition> definitions;
  std::vector<scan::BodyMotion> bodies;
  std::vector<Eigen::Vector4d> start, speed;  ///< x, y, z, yaw of each body
  SemanticModel building;
  Scan real;
  scan::LaserMotion motion;

  World();
  void add(BodyDefinition body, Draw& draw, bool moves);
  /// The motion over scan number `n`, computed from two states as in the server.
  void advance(int n);
};

World::World() {
  Draw draw;
  sweep = scan::beam_times(laser, kBeams, time);
  beams = {static_cast<float>(-std::numbers::pi / 2), static_cast<float>(std::numbers::pi / 360), time};
  for (int i = 0; i < 100; ++i) {
    BodyDefinition body;
    body.shapes.push_back(box({draw.real(0.3, 1), draw.real(0.3, 1), draw.real(0.3, 1.5)}, {0, 0, 0.4}));
    add(body, draw, false);
  }
  for (int i = 0; i < 50; ++i) add(robot(), draw, true);
  for (int i = 0; i < 200; ++i) {
    ModelEntity wall;
    wall.size = {draw.real(1, 10), 0.15, 2.8};
    wall.T_map_body = Transform<Map, Body>::planar(draw.real(-40, 40), draw.real(-40, 40),
                                                   draw.real(0, 1) < 0.5 ? 0 : std::numbers::pi / 2, 1.4);
    building.entities.push_back(wall);
  }
  real.ranges.resize(kBeams);
  for (float& range : real.ranges)
    range = draw.real(0, 1) < 0.2 ? 81.83F : static_cast<float>(draw.real(1, 60));
  advance(0);
}

void World::add(BodyDefinition body, Draw& draw, bool moves) {
  const double distance = draw.real(2, 40), bearing = draw.real(-1.6, 1.6);
  start.emplace_back(distance * std::cos(bearing), distance * std::sin(bearing), 0, draw.real(-3, 3));
  speed.emplace_back(moves ? draw.real(-1, 1) : 0, moves ? draw.real(-1, 1) : 0, 0,
                     moves ? draw.real(-1, 1) : 0);
  definitions.push_back(std::move(body));
  bodies.push_back({&definitions.back(), {}, {}});
}

void World::advance(int n) {
  const double t0 = 0.0267 * (n % 75), t1 = t0 + (sweep.end - sweep.start).seconds();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Eigen::Vector4d p = start[b] + t0 * speed[b], q = start[b] + t1 * speed[b];
    bodies[b].T_map_body_start = Transform<Map, Body>::planar(p.x(), p.y(), p.w(), p.z());
    bodies[b].T_map_body_end = Transform<Map, Body>::planar(q.x(), q.y(), q.w(), q.z());
  }
  motion.T_map_laser_start = Transform<Map, Laser>::planar(0.5 * t0, 0, 0.3 * t0, 0.3);
  motion.T_map_laser_end = Transform<Map, Laser>::planar(0.5 * t1, 0, 0.3 * t1, 0.3);
}

/// Times each scan separately and reports percentiles over all of them, microseconds.
template <class Scan>
void over_scans(benchmark::State& state, World& world, Scan scan) {
  std::vector<double> us;
  int n = 0;
  for (auto _ : state) {
    world.advance(n++);
    const auto start = std::chrono::steady_clock::now();
    scan();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(took.count());
    us.push_back(took.count() * 1e6);
  }
  state.counters["p50_us"] = median(us);
  state.counters["p99_us"] = quantile(us, 0.99, QuantileRank::upper);
}

void whole_path(benchmark::State& state) {
  World world;
  scan::RayCaster caster;
  caster.set_building(world.building);
  std::vector<scan::RangeHit> bodies(kBeams), building(kBeams);
  Scan out;
  std::vector<std::int32_t> beam_body;
  std::size_t replaced = 0;
  std::uint64_t sequence = 0;
  over_scans(state, world, [&] {
    caster.cast_bodies(world.motion, world.beams, world.bodies, kMaxRange, bodies);
    caster.cast_building(world.motion, world.beams, kMaxRange, building);
    replaced = scan::augment_scan(world.real, world.laser, {1, ++sequence}, bodies, building, out, beam_body);
  });
  state.counters["replaced"] = static_cast<double>(replaced);
}
BENCHMARK(whole_path)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(5000);

void bodies_own_caster(benchmark::State& state) {
  World world;
  scan::RayCaster caster;
  std::vector<scan::RangeHit> hits(kBeams);
  over_scans(state, world,
             [&] { caster.cast_bodies(world.motion, world.beams, world.bodies, kMaxRange, hits); });
}
BENCHMARK(bodies_own_caster)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(5000);

void bodies_exact_reference(benchmark::State& state) {
  World world;
  std::vector<scan::RangeHit> hits(kBeams);
  over_scans(state, world,
             [&] { scan::cast_bodies_exact(world.motion, world.beams, world.bodies, kMaxRange, hits); });
}
BENCHMARK(bodies_exact_reference)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(20);

void building_tree(benchmark::State& state) {
  World world;
  scan::RayCaster caster;
  caster.set_building(world.building);
  std::vector<scan::RangeHit> hits(kBeams);
  over_scans(state, world, [&] { caster.cast_building(world.motion, world.beams, kMaxRange, hits); });
}
BENCHMARK(building_tree)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(5000);

/// The walls as one body at rest, through the caster for bodies.
void building_own_caster(benchmark::State& state) {
  World world;
  BodyDefinition walls;
  for (const ModelEntity& entity : world.building.entities) {
    Shape shape;
    shape.size = entity.size;
    shape.T_body_shape = entity.T_map_body.as<Body, ShapeFrame>();  // the body is at the map's origin
    walls.shapes.push_back(shape);
  }
  const std::vector<scan::BodyMotion> bodies{{&walls, {}, {}}};
  scan::RayCaster caster;
  std::vector<scan::RangeHit> hits(kBeams);
  over_scans(state, world, [&] { caster.cast_bodies(world.motion, world.beams, bodies, kMaxRange, hits); });
}
BENCHMARK(building_own_caster)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(5000);

void augment(benchmark::State& state) {
  World world;
  scan::RayCaster caster;
  std::vector<scan::RangeHit> bodies(kBeams), building(kBeams, scan::RangeHit{INFINITY, -1, 0});
  caster.cast_bodies(world.motion, world.beams, world.bodies, kMaxRange, bodies);
  Scan out;
  std::vector<std::int32_t> beam_body;
  std::uint64_t sequence = 0;
  over_scans(state, world, [&] {
    scan::augment_scan(world.real, world.laser, {1, ++sequence}, bodies, building, out, beam_body);
  });
}
BENCHMARK(augment)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(5000);

/// A door 3 m before 1,081 beams of 0.25 degrees, open by 40 degrees.
void leaf_fit(benchmark::State& state) {
  World world;
  LaserDescription laser = world.laser;
  laser.angle_increment = 0.25 * std::numbers::pi / 180;
  laser.angle_min = -540 * laser.angle_increment;
  ModelEntity door;
  door.T_map_body = Transform<Map, Body>::planar(3, 0, std::numbers::pi / 2, 1);
  door.size = {0.9, 0.04, 2};
  door.hinge = Hinge{{-0.45, 0}, 0, std::numbers::pi / 2, 0};
  SemanticModel model;
  model.entities = {door};
  model.entities[0].T_map_body = leaf_at(door, *door.hinge, 0.7);
  const std::vector<float> time(1081, 0);
  const scan::BeamSet beams{static_cast<float>(laser.angle_min), static_cast<float>(laser.angle_increment),
                            time};
  const auto T_map_laser = Transform<Map, Laser>::planar(0, 0, 0, 0.4);
  std::vector<scan::RangeHit> none(time.size(), scan::RangeHit{INFINITY, -1, 0}), hits(time.size());
  scan::cast_building_exact({T_map_laser, T_map_laser}, beams, model, kMaxRange, hits);
  Scan scan;
  scan::simulate_scan(laser, {1, 1}, none, hits, {}, scan);
  scan::LeafFit fit;
  std::size_t returns = 0;
  over_scans(state, world, [&] {
    fit.set_scan(scan, laser, {T_map_laser, T_map_laser}, time, 0.02);
    returns = fit.find(door, *door.hinge, 0.7).returns;
  });
  state.counters["returns"] = static_cast<double>(returns);
}
BENCHMARK(leaf_fit)->UseManualTime()->Unit(benchmark::kMicrosecond)->Iterations(5000);

}  // namespace
}  // namespace parhelion

BENCHMARK_MAIN();

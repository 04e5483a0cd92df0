#include "tests/fusion/people/synthetic_crowd.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "fusion/scan/lidar_model.hpp"
#include "protocols/splitmix64.hpp"
#include "tests/fusion/people/crowd_people.hpp"
#include "tests/fusion/people/crowd_shapes.hpp"

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;
constexpr double kInf = std::numeric_limits<double>::infinity();

struct Rover {
  Pose2 pose;
  Vector2d target;
  double speed = 0.5;
  bool round = true;
  double size = 0.4;
};

class World {
 public:
  explicit World(const CrowdOptions& options) : options_(options), random_(options.seed) { build(); }

  void step(double dt) {
    for (Walker& walker : walkers_) step_walker(walker, dt);
    for (Rover& rover : rovers_) step_rover(rover, dt);
    if (options_.moving_laser) step_rover(own_, dt);
    drift_ += -drift_ * dt / 10 +
              Vector2d(random_.normal(), random_.normal()) * options_.pose_drift * std::sqrt(2 * dt / 10);
    yaw_drift_ += -yaw_drift_ * dt / 10 + random_.normal(options_.pose_drift * 0.2) * std::sqrt(2 * dt / 10);
  }

  Pose2 own() const { return own_.pose; }
  Pose2 estimate() {
    if (!options_.odometry) return {};
    return {own_.pose.x + drift_.x() + random_.normal(options_.pose_noise),
            own_.pose.y + drift_.y() + random_.normal(options_.pose_noise),
            own_.pose.yaw + yaw_drift_ + random_.normal(options_.pose_noise * 0.2)};
  }
  const std::vector<Walker>& walkers() const { return walkers_; }
  const std::vector<Rover>& rovers() const { return rovers_; }
  const std::vector<Shape>& walls() const { return walls_; }
  Random& random() { return random_; }

  /// All shapes at the height of the laser.
  std::vector<Shape> shapes() const {
    std::vector<Shape> all = walls_;
    all.insert(all.end(), furniture_.begin(), furniture_.end());
    for (std::size_t i = 0; i < walkers_.size(); ++i)
      add_walker(all, walkers_[i], options_.laser.height, static_cast<int>(i));
    for (const Rover& rover : rovers_) add_rover(all, rover);
    return all;
  }

 private:
  double width() const { return options_.room; }
  double depth() const { return depth_; }
  Vector2d place() { return {random_.uniform(0.5, width() - 0.5), random_.uniform(0.5, depth() - 0.5)}; }

  void build() {
    depth_ = options_.room * random_.uniform(0.5, 1);
    if (!options_.open) build_walls();
    const double height = options_.laser.height;
    for (int i = 0; i < options_.chairs; ++i) add_chair(place(), height);
    for (int i = 0; i < options_.tables; ++i) add_table(place(), height);
    for (int i = 0; i < options_.poles; ++i)
      add_obstacle(disc(place(), random_.uniform(0.03, 0.16), Source::furniture));
    for (int i = 0; i < options_.bins; ++i)
      add_obstacle(disc(place(), random_.uniform(0.1, 0.22), Source::furniture));
    for (int i = 0; i < options_.boxes; ++i) {
      const Vector2d at = place();
      const double x = random_.uniform(0.15, 0.9), y = random_.uniform(0.15, 0.9);
      add_box(furniture_, {at.x(), at.y(), random_.uniform(0, kPi)}, x, y, Source::furniture);
      obstacles_.push_back({at, std::hypot(x, y) / 2});
    }
    own_.pose = free_pose();
    own_.target = own_.pose.position();
    own_.speed = random_.uniform(0.2, 0.8);
    for (int i = 0; i < options_.robots; ++i) {
      Rover rover;
      rover.pose = free_pose();
      rover.target = rover.pose.position();
      rover.speed = random_.uniform(0.2, 1.0);
      rover.round = random_.chance(0.5);
      rover.size = random_.uniform(0.3, 0.8);
      if (options_.laser.height > random_.uniform(0.2, 1.5)) continue;  // lower than the laser
      rovers_.push_back(rover);
    }
    for (int i = 0; i < options_.walkers + options_.standing; ++i) add_person(i >= options_.walkers);
    if (options_.varied) add_varied();
  }

  /// Other people, postures and things than those of plain crowds.
  void add_varied() {
    for (Walker& walker : walkers_) vary(walker);
    for (int i = 0; i < options_.aids; ++i) add_aid();
    for (int i = 0; i < options_.seated; ++i) add_seated();
    for (int i = 0; i < options_.groups; ++i) add_group();
    for (int i = 0; i < options_.leaning && !options_.open; ++i) add_leaning();
    for (int i = 0; i < options_.seats; ++i) {
      const double toward = random_.uniform(0, 2 * kPi);
      const Vector2d table = place();
      add_table(table, options_.laser.height);
      for (int k = random_.integer(1, 4); k > 0; --k)
        add_chair(table + random_.uniform(0.5, 0.9) * direction(toward + k * kPi / 2), options_.laser.height);
    }
  }

  static Vector2d direction(double yaw) { return {std::cos(yaw), std::sin(yaw)}; }

  void vary(Walker& walker) {
    walker.planted = random_.chance(0.7);
    walker.skirt = random_.chance(0.2);
    walker.coat = {random_.uniform(0.1, 0.18), random_.uniform(0.15, 0.24)};
    walker.stance = random_.uniform(0.05, 0.18);
    walker.leg_radius = random_.uniform(0.032, 0.085);
    walker.ahead = random_.chance(0.5) ? random_.uniform(-0.08, 0.08) : 0;
    walker.next_step = random_.uniform(0, 20);
  }

  void add_aid() {
    add_person(false);
    Walker& walker = walkers_.back();
    vary(walker);
    constexpr Aid kAids[] = {Aid::frame, Aid::pram, Aid::trolley, Aid::wheelchair};
    walker.aid = kAids[random_.integer(0, 3)];
    walker.speed = random_.uniform(0.3, 1.1);
    walker.skirt = walker.skirt && walker.aid != Aid::wheelchair;
    walker.stands = random_.chance(0.25);
    if (walker.aid != Aid::wheelchair || !random_.chance(0.4)) return;
    add_person(false);
    vary(walkers_.back());
    walkers_.back().pushes = static_cast<int>(walkers_.size()) - 2;
  }

  void add_seated() {
    add_person(true);
    Walker& walker = walkers_.back();
    vary(walker);
    walker.sits = true;
    add_chair(walker.position, options_.laser.height, walker.heading);
  }

  /// Who stand and talk.
  void add_group() {
    const Vector2d middle = free_pose().position();
    const double radius = random_.uniform(0.35, 0.8), first = random_.uniform(0, 2 * kPi);
    const int people = random_.integer(2, 4);
    for (int i = 0; i < people; ++i) {
      add_person(true);
      vary(walkers_.back());
      const double yaw = first + 2 * kPi * i / people + random_.normal(0.2);
      walkers_.back().position = walkers_.back().target = middle + radius * direction(yaw);
      walkers_.back().heading = yaw + kPi + random_.normal(0.3);
    }
    obstacles_.push_back({middle, radius});
  }

  /// With the back to a wall.
  void add_leaning() {
    add_person(true);
    Walker& walker = walkers_.back();
    vary(walker);
    const int wall = random_.integer(0, 3);
    const double off = random_.uniform(0.15, 0.4);
    if (wall % 2 == 0)
      walker.position.y() = wall == 0 ? off : depth() - off;
    else
      walker.position.x() = wall == 3 ? off : width() - off;
    walker.target = walker.position;
    walker.heading = kPi / 2 * (wall + 1);
  }

  void build_walls() {
    const Vector2d corners[] = {{0, 0}, {width(), 0}, {width(), depth()}, {0, depth()}};
    for (int k = 0; k < 4; ++k) {
      const Vector2d a = corners[k], b = corners[(k + 1) % 4], along = (b - a).normalized();
      const Vector2d inward(-along.y(), along.x());
      const double door = random_.uniform(0.2, 0.7) * (b - a).norm();
      const double visible = options_.glass && k == 1 ? 0.15 : 1;
      walls_.push_back(line(a, a + along * door, Source::building, visible));
      walls_.push_back(line(a + along * (door + 0.9), b, Source::building, visible));
      // The doorway: posts that stand out, and a room behind it.
      for (const double s : {door, door + 0.9}) {
        walls_.push_back(line(a + along * s, a + along * s + inward * 0.08, Source::building));
        walls_.push_back(line(a + along * (s - 0.05) + inward * 0.08, a + along * (s + 0.05) + inward * 0.08,
                              Source::building));
      }
      walls_.push_back(
          line(a + along * door - inward * 1.5, a + along * (door + 0.9) - inward * 1.5, Source::building));
    }
    const int pillars = random_.integer(0, 3);
    for (int i = 0; i < pillars; ++i) {
      const Vector2d at = place();
      add_box(walls_, {at.x(), at.y(), 0}, 0.4, 0.4, Source::building);
      obstacles_.push_back({at, 0.3});
    }
  }

  void add_obstacle(const Shape& shape) {
    furniture_.push_back(shape);
    obstacles_.push_back({shape.a, shape.b.x()});
  }

  void add_chair(const Vector2d& at, double height) { add_chair(at, height, random_.uniform(0, 2 * kPi)); }

  void add_chair(const Vector2d& at, double height, double yaw) {
    const Pose2 pose{at.x(), at.y(), yaw};
    obstacles_.push_back({at, 0.35});
    if (height > 0.9) return;  // under the beams
    if (height > 0.5) {        // its back
      furniture_.push_back(line(pose * Vector2d(-0.2, -0.2), pose * Vector2d(-0.2, 0.2), Source::furniture));
      return;
    }
    if (random_.chance(0.3)) {  // on a column with five feet
      const int feet = 5;
      furniture_.push_back(disc(at, random_.uniform(0.025, 0.04), Source::furniture));
      if (height > 0.12) return;
      for (int k = 0; k < feet; ++k)
        furniture_.push_back(
            disc(pose * (0.3 * Vector2d(std::cos(2 * kPi * k / feet), std::sin(2 * kPi * k / feet))), 0.03,
                 Source::furniture));
      return;
    }
    const double x = random_.uniform(0.36, 0.5) / 2, y = random_.uniform(0.36, 0.5) / 2;
    const double radius = random_.uniform(0.01, 0.028);
    for (const double sx : {-x, x})
      for (const double sy : {-y, y})
        furniture_.push_back(disc(pose * Vector2d(sx, sy), radius, Source::furniture));
  }

  void add_table(const Vector2d& at, double height) {
    const Pose2 pose{at.x(), at.y(), random_.uniform(0, 2 * kPi)};
    const double x = random_.uniform(0.7, 1.8) / 2, y = random_.uniform(0.6, 0.9) / 2;
    obstacles_.push_back({at, std::hypot(x, y)});
    if (height > 0.75) return;
    const bool square = random_.chance(0.5);
    const double size = random_.uniform(0.03, 0.09);
    for (const double sx : {-x, x}) {
      for (const double sy : {-y, y}) {
        const Vector2d leg = pose * Vector2d(sx * 0.9, sy * 0.9);
        if (square)
          add_box(furniture_, {leg.x(), leg.y(), pose.yaw}, size, size, Source::furniture);
        else
          furniture_.push_back(disc(leg, size / 2, Source::furniture));
      }
    }
  }

  void add_person(bool stands) {
    Walker walker;
    walker.position = walker.target = free_pose().position();
    walker.heading = random_.uniform(0, 2 * kPi);
    walker.speed = random_.uniform(0.5, 1.6);
    walker.leg_radius = random_.uniform(0.045, 0.08);
    walker.stance = random_.uniform(0.07, 0.14);
    walker.body_width = random_.uniform(0.36, 0.5);
    walker.body_depth = random_.uniform(0.2, 0.3);
    walker.stands = stands;
    walker.skirt = random_.chance(0.08);
    walker.phase = random_.uniform(0, 2 * kPi);
    walkers_.push_back(walker);
  }

  bool is_free(const Vector2d& p, double clearance) const {
    if (p.x() < clearance || p.y() < clearance || p.x() > width() - clearance || p.y() > depth() - clearance)
      return false;
    return std::all_of(obstacles_.begin(), obstacles_.end(), [&](const Obstacle& each) {
      return (each.center - p).norm() > each.radius + clearance;
    });
  }
  Pose2 free_pose() {
    for (int k = 0; k < 200; ++k) {
      const Vector2d p = place();
      if (is_free(p, 0.35)) return {p.x(), p.y(), random_.uniform(0, 2 * kPi)};
    }
    return {width() / 2, depth() / 2, 0};
  }
  bool path_is_free(const Vector2d& a, const Vector2d& b, double clearance) const {
    const int n = static_cast<int>((b - a).norm() / 0.1) + 1;
    for (int k = 1; k <= n; ++k)
      if (!is_free(a + (b - a) * k / n, clearance)) return false;
    return true;
  }
  std::optional<Vector2d> next_target(const Vector2d& from, double clearance) {
    for (int k = 0; k < 20; ++k) {
      const Vector2d p = place();
      if ((p - from).norm() > 0.8 && path_is_free(from, p, clearance)) return p;
    }
    return std::nullopt;
  }

  /// Behind the wheelchair.
  void step_carer(Walker& carer, const Walker& chair, double dt) {
    const Vector2d before = carer.position;
    const Vector2d path = chair.position - 0.62 * direction(chair.heading) - before;
    carer.position += path * std::min(1.0, 2 * dt / std::max(path.norm(), 1e-9));
    carer.heading = chair.heading;
    carer.velocity = (carer.position - before) / dt;
  }

  void step_walker(Walker& walker, double dt) {
    walker.sway +=
        -walker.sway * dt + Vector2d(random_.normal(), random_.normal()) * 0.012 * std::sqrt(2 * dt);
    walker.weight += -walker.weight * dt / 3 + random_.normal(0.02) * std::sqrt(2 * dt / 3);
    if (walker.pushes >= 0) {
      step_carer(walker, walkers_[static_cast<std::size_t>(walker.pushes)], dt);
      walker.phase += kPi * dt * walker.velocity.norm() / step_length(walker.velocity.norm());
      return;
    }
    const double clearance = walker.aid == Aid::none ? 0.25 : 0.5;
    if (options_.varied) shift_feet(walker, dt);
    const Vector2d path = walker.target - walker.position;
    if (walker.stands || walker.pause > 0 || path.norm() < 0.1) {
      walker.pause -= dt;
      walker.velocity *= std::exp(-dt / 0.2);
      if (!walker.stands && walker.pause <= 0) {
        if (path.norm() < 0.1 && random_.chance(0.3)) walker.pause = random_.uniform(0.5, 8);
        if (const auto next = next_target(walker.position, clearance)) walker.target = *next;
      }
    } else {
      double speed = walker.speed * std::min(path.norm() / 0.4 + 0.2, 1.0);
      for (const Walker& other : walkers_) {
        const Vector2d gap = other.position - walker.position;
        if (other.pushes >= 0 && &walkers_[static_cast<std::size_t>(other.pushes)] == &walker) continue;
        const double reach = walker.aid == Aid::none ? 0.7 : 1.3;
        if (&other != &walker && gap.norm() < reach && gap.dot(path) > 0) speed = 0;
      }
      if (speed == 0 && random_.chance(dt)) {
        if (const auto next = next_target(walker.position, clearance)) walker.target = *next;
      }
      walker.velocity += (path.normalized() * speed - walker.velocity) * std::min(dt / 0.25, 1.0);
    }
    walker.position += walker.velocity * dt;
    const double speed = walker.velocity.norm();
    if (speed > 0.1) {
      const double course = std::atan2(walker.velocity.y(), walker.velocity.x());
      const double turn = wrap_angle(course - walker.heading), max_turn = 1.5 * dt;
      walker.heading =
          walker.aid == Aid::none ? course : walker.heading + std::clamp(turn, -max_turn, max_turn);
    }
    walker.phase += 2 * kPi * dt * speed / (2 * step_length(speed));
  }

  void shift_feet(Walker& walker, double dt) {
    walker.next_step -= dt;
    if (walker.next_step > 0) return;
    walker.next_step = random_.uniform(3, 25);
    walker.ahead = random_.uniform(-0.08, 0.08);
    if (walker.stands && !walker.sits) walker.heading += random_.normal(0.15);
  }

  void step_rover(Rover& rover, double dt) {
    const Vector2d path = rover.target - rover.pose.position();
    if (path.norm() < 0.15) {
      if (const auto next = next_target(rover.pose.position(), 0.4)) rover.target = *next;
      return;
    }
    const double off = wrap_angle(std::atan2(path.y(), path.x()) - rover.pose.yaw);
    const double turn = std::clamp(2 * off, -1.0, 1.0);
    const double speed = std::abs(off) < 0.5 ? rover.speed : 0;
    rover.pose = rover.pose * moved(Twist2{speed, 0, turn}, dt);
  }

  static void add_rover(std::vector<Shape>& all, const Rover& rover) {
    if (rover.round)
      all.push_back(disc(rover.pose.position(), rover.size / 2, Source::robot));
    else
      add_box(all, rover.pose, rover.size, rover.size * 0.7, Source::robot);
  }

  struct Obstacle {
    Vector2d center;
    double radius;
  };
  CrowdOptions options_;
  Random random_;
  double depth_ = 0;
  std::vector<Shape> walls_, furniture_;
  std::vector<Obstacle> obstacles_;
  std::vector<Walker> walkers_;
  std::vector<Rover> rovers_;
  Rover own_;
  Vector2d drift_ = Vector2d::Zero();
  double yaw_drift_ = 0;
};

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

double beam_angle(const LaserDescription& laser, int i) {
  return laser.angle_min + i * laser.angle_increment;
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

/// Seven of ten crowds: at the height of ankles or knees.
void vary_laser(Random& random, LaserKind& laser) {
  if (random.chance(0.7)) laser.height = random.uniform(0.07, 0.6);
  if (random.chance(0.5)) laser.rate = random.uniform(10, 40);
}

}  // namespace

double Random::uniform(double low, double high) {
  state_ += kSplitMix64Increment;
  return low + (high - low) * unit_interval(splitmix64(state_));
}
double Random::normal(double sigma) {
  const double u = 1 - uniform(), v = uniform();
  return sigma * std::sqrt(-2 * std::log(u)) * std::cos(2 * kPi * v);
}
int Random::integer(int low, int high) {
  return std::min(high, low + static_cast<int>(uniform() * (high - low + 1)));
}

CrowdOptions random_crowd(std::uint64_t seed) {
  Random random(seed ^ 0xC0FFEE);
  CrowdOptions options;
  options.seed = seed;
  options.walkers = random.integer(1, 7);
  options.standing = random.integer(0, 3);
  options.chairs = random.integer(0, 10);
  options.tables = random.integer(0, 4);
  options.poles = random.integer(0, 6);
  options.boxes = random.integer(0, 5);
  options.bins = random.integer(0, 4);
  options.robots = random.integer(0, 2);
  options.room = random.uniform(6, 18);
  options.open = random.chance(0.15);
  options.glass = random.chance(0.4);
  options.moving_laser = random.chance(0.7);
  options.model = random.chance(0.5);
  options.pose_noise = random.uniform(0, 0.012);
  options.pose_drift = random.uniform(0, 0.05);
  LaserKind& laser = options.laser;
  constexpr int kBeams[] = {180, 245, 361, 512, 720, 768, 1081};
  laser.beams = kBeams[random.integer(0, 6)];
  laser.field = laser.beams == 245 ? 1.5 : random.chance(0.4) ? 2 * kPi : random.uniform(3.1, 4.72);
  constexpr double kRates[] = {5.5, 7.5, 10, 10, 15, 25, 40};
  laser.rate = kRates[random.integer(0, 6)];
  laser.range_max = random.uniform(5, 30);
  laser.noise = random.uniform(0.003, 0.03);
  laser.quantization = random.chance(0.3) ? 0.01 : 0;
  laser.dropout = random.chance(0.3) ? random.uniform(0, 0.03) : 0.001;
  laser.mixed = random.uniform(0, 0.7);
  constexpr double kHeights[] = {0.1, 0.18, 0.25, 0.35, 0.5, 0.85, 1.1};
  laser.height = kHeights[random.integer(0, 6)];
  laser.clockwise = random.chance(0.2);
  return options;
}

CrowdOptions varied_crowd(std::uint64_t seed) {
  CrowdOptions options = random_crowd(seed);
  Random random(seed ^ 0x5EA7ED);
  options.varied = true;
  options.walkers = random.integer(0, 4);
  options.aids = random.integer(0, 2);
  options.seated = random.integer(0, 2);
  options.groups = random.integer(0, 2);
  options.leaning = random.integer(0, 2);
  options.seats = random.integer(0, 2);
  options.odometry = !options.moving_laser || random.chance(0.75);
  options.model = options.model && options.odometry;
  vary_laser(random, options.laser);
  return options;
}

Crowd make_crowd(const CrowdOptions& options) {
  World world(options);
  Crowd crowd;
  crowd.laser = describe(options.laser);
  const auto beams = static_cast<std::size_t>(options.laser.beams);
  scan::beam_times(crowd.laser, beams, crowd.beam_time);
  crowd.sigma = std::hypot(options.pose_noise, options.pose_drift);
  for (int k = 0; k < 40; ++k) world.step(0.05);
  const int n = static_cast<int>(options.duration * options.laser.rate);
  const double period = 1 / options.laser.rate;
  for (int k = 0; k < n; ++k) {
    CrowdScan out;
    out.stamp = SimulationTime{seconds(1000 + k * period).ns};
    out.scan.stamp = SensorTime{out.stamp.ns};
    out.scan.angle_min = static_cast<float>(crowd.laser.angle_min);
    out.scan.angle_increment = static_cast<float>(crowd.laser.angle_increment);
    measure(options, crowd.laser, world, out);
    world.step(0.1 / options.laser.rate);
    if (options.model) {
      const Pose2 middle =
          interpolate(planar(out.estimated.T_map_laser_start), planar(out.estimated.T_map_laser_end), 0.5);
      for (int i = 0; i < options.laser.beams; ++i) {
        const double angle = middle.yaw + beam_angle(crowd.laser, i);
        const Hit wall = cast(world.walls(), middle.position(), {std::cos(angle), std::sin(angle)}, nullptr);
        out.building.push_back(
            {static_cast<float>(wall.range < options.laser.range_max ? wall.range : kInf), -1, 0});
      }
    }
    crowd.scans.push_back(std::move(out));
  }
  return crowd;
}

}  // namespace parhelion::test

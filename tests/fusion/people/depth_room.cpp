#include "tests/fusion/people/depth_room.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFocal = 230;  // pixels
constexpr double kFar = 9;      // m: nothing is measured beyond
constexpr int kNobody = -1;

/// An upright cylinder, or a box with sides along x and y.
struct Solid {
  bool round = true;
  Vector2d center;
  Vector2d half;  ///< m: of a cylinder its radius, twice
  double bottom, top;
  int person = kNobody;
};

/// Where a ray enters the solid, in units of `direction`; infinite: it misses.
double enter(const Solid& solid, const Vector3d& eye, const Vector3d& direction) {
  double near = 0, far = std::numeric_limits<double>::infinity();
  const auto slab = [&](double at, double slope, double low, double high) {
    if (slope == 0) return low <= at && at <= high;
    const double a = (low - at) / slope, b = (high - at) / slope;
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
    return near <= far;
  };
  constexpr double miss = std::numeric_limits<double>::infinity();
  if (!slab(eye.z(), direction.z(), solid.bottom, solid.top)) return miss;
  const Vector2d offset = eye.head<2>() - solid.center, d = direction.head<2>();
  if (!solid.round) {
    const bool hit = slab(offset.x(), d.x(), -solid.half.x(), solid.half.x()) &&
                     slab(offset.y(), d.y(), -solid.half.y(), solid.half.y());
    return hit ? near : miss;
  }
  const double a = d.squaredNorm(), b = offset.dot(d),
               c = offset.squaredNorm() - solid.half.x() * solid.half.x();
  const double root = b * b - a * c;
  if (root < 0) return miss;
  near = std::max(near, (-b - std::sqrt(root)) / a);
  far = std::min(far, (-b + std::sqrt(root)) / a);
  return near <= far ? near : miss;
}

struct Walker {
  Vector2d position, target;
  double speed = 0, phase = 0;
  Vector2d velocity = Vector2d::Zero();
};

class World {
 public:
  explicit World(const DepthRoomOptions& options) : options_(options), random_(options.seed) {
    for (int i = 0; i < options.poles; ++i) furnish(true, {0.06, 0.06}, 0, 2);
    for (int i = 0; i < options.boxes; ++i)
      furnish(false, {random_.uniform(0.15, 0.4), random_.uniform(0.15, 0.4)}, 0, random_.uniform(0.3, 1.6));
    for (int i = 0; i < options.tables; ++i) add_table();
    for (int i = 0; i < options.walkers + options.standing; ++i) {
      const Vector2d start = place();
      walkers_.push_back({start, i < options.walkers ? place() : start,
                          i < options.walkers ? random_.uniform(0.4, 1.4) : 0, random_.uniform(0, 6)});
    }
  }

  void step(double dt) {
    for (Walker& walker : walkers_) {
      const Vector2d path = walker.target - walker.position;
      if (walker.speed > 0 && path.norm() < 0.2) walker.target = place();
      walker.velocity = walker.speed > 0 ? Vector2d(walker.speed * path.normalized()) : Vector2d::Zero();
      walker.position += dt * walker.velocity;
      walker.phase += dt * (2 + 5 * walker.speed);
    }
  }

  std::vector<Solid> solids() const {
    std::vector<Solid> all = furniture_;
    for (std::size_t i = 0; i < walkers_.size(); ++i) add_person(all, walkers_[i], static_cast<int>(i));
    return all;
  }
  std::vector<TruePerson> people() const {
    std::vector<TruePerson> all;
    for (std::size_t i = 0; i < walkers_.size(); ++i)
      all.push_back({static_cast<int>(i), walkers_[i].position, walkers_[i].velocity, 0});
    return all;
  }
  Random& random() { return random_; }

 private:
  /// Free of furniture, and not where the robot stands.
  Vector2d place() {
    Vector2d at;
    bool is_free = false;
    for (int trial = 0; trial < 200 && !is_free; ++trial) {
      at = {random_.uniform(-2.4, 3.4), random_.uniform(-2.9, 2.9)};
      is_free = std::all_of(furniture_.begin(), furniture_.end(), [&](const Solid& solid) {
        return (solid.center - at).norm() > solid.half.norm() + 0.4;
      });
    }
    return at;
  }
  void furnish(bool round, const Vector2d& half, double bottom, double top) {
    furniture_.push_back({round, place(), half, bottom, top});
  }
  void add_table() {
    const Vector2d at = place(), half(random_.uniform(0.4, 0.7), random_.uniform(0.3, 0.5));
    furniture_.push_back({false, at, half, 0.7, 0.74});
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0})
        furniture_.push_back(
            {true, at + Vector2d(x * (half.x() - 0.05), y * (half.y() - 0.05)), {0.025, 0.025}, 0, 0.7});
  }
  static void add_person(std::vector<Solid>& all, const Walker& walker, int id) {
    const double speed = walker.velocity.norm();
    const Vector2d ahead = speed > 0 ? Vector2d(walker.velocity / speed) : Vector2d::UnitX();
    const Vector2d left(-ahead.y(), ahead.x());
    for (const double side : {-1.0, 1.0}) {
      const double stride = side * std::sin(walker.phase) * std::min(0.35, 0.3 * speed);
      const Vector2d hip = walker.position + 0.1 * side * left;
      all.push_back({true, hip + stride * ahead, {0.065, 0.065}, 0, 0.45, id});
      all.push_back({true, hip + 0.5 * stride * ahead, {0.08, 0.08}, 0.45, 0.85, id});
      all.push_back({true, walker.position + 0.08 * side * left, {0.13, 0.13}, 0.85, 1.45, id});
      all.push_back(
          {true, walker.position + 0.25 * side * left - 0.4 * stride * ahead, {0.045, 0.045}, 0.75, 1.4, id});
    }
    all.push_back({true, walker.position, {0.1, 0.1}, 1.5, 1.75, id});
  }

  DepthRoomOptions options_;
  Random random_;
  std::vector<Solid> furniture_;
  std::vector<Walker> walkers_;
};

Transform<Map, DepthOptical> camera_at(const Vector2d& at, double yaw, double pitch, double roll, double z) {
  const Eigen::Quaterniond R_map_base = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                                        Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                                        Eigen::AngleAxisd(roll, Vector3d::UnitX());
  Eigen::Matrix3d R_base_optical;
  R_base_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {R_map_base * Eigen::Quaterniond(R_base_optical), {at.x(), at.y(), z}};
}

struct PixelHit {
  double depth = 0;  ///< m along the axis; 0: too far
  int person = kNobody;
};

PixelHit look(const std::vector<Solid>& solids, const Vector2d& half, const Vector3d& eye,
              const Vector3d& direction) {
  PixelHit hit{kFar, kNobody};
  for (const Solid& solid : solids) {
    const double depth = enter(solid, eye, direction);
    if (depth < hit.depth) hit = {depth, solid.person};
  }
  const auto plane = [&](double at, double slope, double wall) {
    const double depth = (wall - at) / slope;
    if (slope != 0 && depth > 0 && depth < hit.depth) hit = {depth, kNobody};
  };
  plane(eye.z(), direction.z(), 0);
  for (const int axis : {0, 1}) plane(eye[axis], direction[axis], std::copysign(half[axis], direction[axis]));
  return hit.depth < kFar ? hit : PixelHit{};
}

void render(const DepthRoom& room, const DepthRoomOptions& options, const std::vector<Solid>& solids,
            const Transform<Map, DepthOptical>& T_map_depth, Random& random, DepthRoomImage& image) {
  const Eigen::Matrix3d R = T_map_depth.rotation();
  const Vector3d eye = T_map_depth.translation();
  double before = 0;
  for (const Eigen::Vector3f& direction : room.directions) {
    const PixelHit hit = look(solids, room.half, eye, R * direction.cast<double>());
    // Beside an edge triangulation often has no partner.
    const bool lost = std::abs(hit.depth - before) > 0.2 && random.chance(0.5);
    before = hit.depth;
    const double depth = hit.depth + random.normal(options.noise * hit.depth * hit.depth);
    image.millimetres.push_back(lost || hit.depth == 0 || random.chance(0.01)
                                    ? 0
                                    : static_cast<std::uint16_t>(std::lround(1000 * depth)));
    if (hit.person != kNobody) ++image.people[static_cast<std::size_t>(hit.person)].beams;
  }
}

}  // namespace

people::DepthView DepthRoom::view(const DepthRoomImage& image) const {
  people::DepthView view;
  view.width = kWidth, view.height = kHeight;
  view.millimetres = image.millimetres;
  view.directions = directions;
  view.T_map_depth = image.T_map_depth;
  return view;
}

std::vector<scan::RangeHit> DepthRoom::building(const people::DepthSlice& slice) const {
  std::vector<scan::RangeHit> hits(slice.scan().ranges.size());
  const auto& T = slice.motion().T_map_laser_end;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double angle = T.yaw() + slice.scan().angle(i);
    const Vector2d d(std::cos(angle), std::sin(angle)), eye = T.translation().head<2>();
    const double x = (std::copysign(half.x(), d.x()) - eye.x()) / d.x(),
                 y = (std::copysign(half.y(), d.y()) - eye.y()) / d.y();
    hits[i].range = static_cast<float>(std::min(x, y));
  }
  return hits;
}

DepthRoom make_depth_room(const DepthRoomOptions& options) {
  DepthRoom room;
  for (int y = 0; y < DepthRoom::kHeight; ++y)
    for (int x = 0; x < DepthRoom::kWidth; ++x)
      room.directions.emplace_back(static_cast<float>((x - (DepthRoom::kWidth - 1) / 2.0) / kFocal),
                                   static_cast<float>((y - (DepthRoom::kHeight - 1) / 2.0) / kFocal), 1.0F);
  room.sigma = std::hypot(options.pose_noise, options.pose_drift);
  World world(options);
  Random& random = world.random();
  const Vector2d drift(random.normal(options.pose_drift), random.normal(options.pose_drift));
  const double period = 1 / options.rate, sway = random.uniform(0, 0.6);
  for (int k = 0; k < static_cast<int>(options.duration * options.rate); ++k) {
    world.step(period);
    const Vector2d at(-3.2, 0);
    const double yaw = sway * std::sin(0.5 * k * period);
    const double pitch = options.pitch + random.normal(options.tremble),
                 roll = random.normal(options.tremble);
    DepthRoomImage image;
    image.stamp = SimulationTime{seconds(1000 + k * period).ns};
    image.people = world.people();
    render(room, options, world.solids(), camera_at(at, yaw, pitch, roll, options.height), random, image);
    const Vector2d error =
        drift + Vector2d(random.normal(options.pose_noise), random.normal(options.pose_noise));
    image.T_map_depth = camera_at(at + error, yaw, pitch, roll, options.height);
    room.images.push_back(std::move(image));
  }
  return room;
}

}  // namespace parhelion::test

#include "tests/fusion/people/crowd_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;

void add_rover(std::vector<Shape>& all, const Rover& rover) {
  if (rover.round)
    all.push_back(disc(rover.pose.position(), rover.size / 2, Source::robot));
  else
    add_box(all, rover.pose, rover.size, rover.size * 0.7, Source::robot);
}

}  // namespace

World::World(const CrowdOptions& options)
    : options_(options),
      random_(options.seed),
      room_(options.room, options.room * random_.uniform(0.5, 1), options.laser.height),
      walkers_(options_, room_, random_) {
  if (!options_.open) room_.add_walls(options_.glass, random_);
  add_furniture();
  add_rovers();
  for (int i = 0; i < options_.walkers + options_.standing; ++i) walkers_.add_person(i >= options_.walkers);
  if (options_.varied) add_varied();
}

void World::add_furniture() {
  const auto add_round = [&](double low, double high) {
    room_.add_round(disc(room_.place(random_), random_.uniform(low, high), Source::furniture));
  };
  for (int i = 0; i < options_.chairs; ++i) {
    const Vector2d at = room_.place(random_);
    room_.add_chair(at, random_.uniform(0, 2 * kPi), random_);
  }
  for (int i = 0; i < options_.tables; ++i) room_.add_table(room_.place(random_), random_);
  for (int i = 0; i < options_.poles; ++i) add_round(0.03, 0.16);
  for (int i = 0; i < options_.bins; ++i) add_round(0.1, 0.22);
  for (int i = 0; i < options_.boxes; ++i) room_.add_box(random_);
}

void World::add_rovers() {
  own_.pose = room_.free_pose(random_);
  own_.target = own_.pose.position();
  own_.speed = random_.uniform(0.2, 0.8);
  for (int i = 0; i < options_.robots; ++i) {
    Rover rover;
    rover.pose = room_.free_pose(random_);
    rover.target = rover.pose.position();
    rover.speed = random_.uniform(0.2, 1.0);
    rover.round = random_.chance(0.5);
    rover.size = random_.uniform(0.3, 0.8);
    if (options_.laser.height > random_.uniform(0.2, 1.5)) continue;  // lower than the laser
    rovers_.push_back(rover);
  }
}

void World::add_varied() {
  walkers_.vary_all();
  for (int i = 0; i < options_.aids; ++i) walkers_.add_aid();
  for (int i = 0; i < options_.seated; ++i) walkers_.add_seated();
  for (int i = 0; i < options_.groups; ++i) walkers_.add_group();
  for (int i = 0; i < options_.leaning && !options_.open; ++i) walkers_.add_leaning();
  for (int i = 0; i < options_.seats; ++i) add_seats();
}

/// A table with chairs.
void World::add_seats() {
  const double toward = random_.uniform(0, 2 * kPi);
  const Vector2d table = room_.place(random_);
  room_.add_table(table, random_);
  for (int k = random_.integer(1, 4); k > 0; --k) {
    const double yaw = toward + k * kPi / 2;
    const Vector2d at = table + random_.uniform(0.5, 0.9) * Vector2d(std::cos(yaw), std::sin(yaw));
    room_.add_chair(at, random_.uniform(0, 2 * kPi), random_);
  }
}

void World::step(double dt) {
  walkers_.step(dt);
  for (Rover& rover : rovers_) step_rover(rover, dt);
  if (options_.moving_laser) step_rover(own_, dt);
  drift_ += -drift_ * dt / 10 +
            Vector2d(random_.normal(), random_.normal()) * options_.pose_drift * std::sqrt(2 * dt / 10);
  yaw_drift_ += -yaw_drift_ * dt / 10 + random_.normal(options_.pose_drift * 0.2) * std::sqrt(2 * dt / 10);
}

void World::step_rover(Rover& rover, double dt) {
  const Vector2d path = rover.target - rover.pose.position();
  if (path.norm() < 0.15) {
    if (const auto next = room_.next_target(rover.pose.position(), 0.4, random_)) rover.target = *next;
    return;
  }
  const double off = wrap_angle(std::atan2(path.y(), path.x()) - rover.pose.yaw);
  const double turn = std::clamp(2 * off, -1.0, 1.0);
  const double speed = std::abs(off) < 0.5 ? rover.speed : 0;
  rover.pose = rover.pose * moved(Twist2{speed, 0, turn}, dt);
}

Pose2 World::estimate() {
  if (!options_.odometry) return {};
  return {own_.pose.x + drift_.x() + random_.normal(options_.pose_noise),
          own_.pose.y + drift_.y() + random_.normal(options_.pose_noise),
          own_.pose.yaw + yaw_drift_ + random_.normal(options_.pose_noise * 0.2)};
}

std::vector<Shape> World::shapes() const {
  std::vector<Shape> all = room_.walls();
  all.insert(all.end(), room_.furniture().begin(), room_.furniture().end());
  for (std::size_t i = 0; i < walkers().size(); ++i)
    add_walker(all, walkers()[i], options_.laser.height, static_cast<int>(i));
  for (const Rover& rover : rovers_) add_rover(all, rover);
  return all;
}

}  // namespace parhelion::test

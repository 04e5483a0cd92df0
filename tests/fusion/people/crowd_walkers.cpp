#include "tests/fusion/people/crowd_walkers.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;

Vector2d direction(double yaw) { return {std::cos(yaw), std::sin(yaw)}; }

}  // namespace

void Walkers::add_person(bool stands) {
  Walker walker;
  walker.position = walker.target = room_.free_pose(random_).position();
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

void Walkers::vary_all() {
  for (Walker& walker : walkers_) vary(walker);
}

void Walkers::vary(Walker& walker) {
  walker.planted = random_.chance(0.7);
  walker.skirt = random_.chance(0.2);
  walker.coat = {random_.uniform(0.1, 0.18), random_.uniform(0.15, 0.24)};
  walker.stance = random_.uniform(0.05, 0.18);
  walker.leg_radius = random_.uniform(0.032, 0.085);
  walker.ahead = random_.chance(0.5) ? random_.uniform(-0.08, 0.08) : 0;
  walker.next_step = random_.uniform(0, 20);
}

void Walkers::add_aid() {
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

void Walkers::add_seated() {
  add_person(true);
  Walker& walker = walkers_.back();
  vary(walker);
  walker.sits = true;
  room_.add_chair(walker.position, walker.heading, random_);
}

void Walkers::add_group() {
  const Vector2d middle = room_.free_pose(random_).position();
  const double radius = random_.uniform(0.35, 0.8), first = random_.uniform(0, 2 * kPi);
  const int people = random_.integer(2, 4);
  for (int i = 0; i < people; ++i) {
    add_person(true);
    vary(walkers_.back());
    const double yaw = first + 2 * kPi * i / people + random_.normal(0.2);
    walkers_.back().position = walkers_.back().target = middle + radius * direction(yaw);
    walkers_.back().heading = yaw + kPi + random_.normal(0.3);
  }
  room_.add_obstacle(middle, radius);
}

void Walkers::add_leaning() {
  add_person(true);
  Walker& walker = walkers_.back();
  vary(walker);
  const int wall = random_.integer(0, 3);
  const double off = random_.uniform(0.15, 0.4);
  if (wall % 2 == 0)
    walker.position.y() = wall == 0 ? off : room_.depth() - off;
  else
    walker.position.x() = wall == 3 ? off : room_.width() - off;
  walker.target = walker.position;
  walker.heading = kPi / 2 * (wall + 1);
}

void Walkers::step(double dt) {
  for (Walker& walker : walkers_) step_walker(walker, dt);
}

/// Behind the wheelchair.
void Walkers::step_carer(Walker& carer, const Walker& chair, double dt) {
  const Vector2d before = carer.position;
  const Vector2d path = chair.position - 0.62 * direction(chair.heading) - before;
  carer.position += path * std::min(1.0, 2 * dt / std::max(path.norm(), 1e-9));
  carer.heading = chair.heading;
  carer.velocity = (carer.position - before) / dt;
}

void Walkers::step_walker(Walker& walker, double dt) {
  walker.sway += -walker.sway * dt + Vector2d(random_.normal(), random_.normal()) * 0.012 * std::sqrt(2 * dt);
  walker.weight += -walker.weight * dt / 3 + random_.normal(0.02) * std::sqrt(2 * dt / 3);
  if (walker.pushes >= 0) {
    step_carer(walker, walkers_[static_cast<std::size_t>(walker.pushes)], dt);
    walker.phase += kPi * dt * walker.velocity.norm() / step_length(walker.velocity.norm());
    return;
  }
  const double clearance = walker.aid == Aid::none ? 0.25 : 0.5;
  if (options_.varied) shift_feet(walker, dt);
  if (walker.stands || walker.pause > 0 || (walker.target - walker.position).norm() < 0.1)
    pause(walker, clearance, dt);
  else
    walk(walker, clearance, dt);
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

void Walkers::pause(Walker& walker, double clearance, double dt) {
  walker.pause -= dt;
  walker.velocity *= std::exp(-dt / 0.2);
  if (walker.stands || walker.pause > 0) return;
  if ((walker.target - walker.position).norm() < 0.1 && random_.chance(0.3))
    walker.pause = random_.uniform(0.5, 8);
  if (const auto next = room_.next_target(walker.position, clearance, random_)) walker.target = *next;
}

void Walkers::walk(Walker& walker, double clearance, double dt) {
  const Vector2d path = walker.target - walker.position;
  double speed = walker.speed * std::min(path.norm() / 0.4 + 0.2, 1.0);
  for (const Walker& other : walkers_) {
    const Vector2d gap = other.position - walker.position;
    if (other.pushes >= 0 && &walkers_[static_cast<std::size_t>(other.pushes)] == &walker) continue;
    const double reach = walker.aid == Aid::none ? 0.7 : 1.3;
    if (&other != &walker && gap.norm() < reach && gap.dot(path) > 0) speed = 0;
  }
  if (speed == 0 && random_.chance(dt)) {
    if (const auto next = room_.next_target(walker.position, clearance, random_)) walker.target = *next;
  }
  walker.velocity += (path.normalized() * speed - walker.velocity) * std::min(dt / 0.25, 1.0);
}

void Walkers::shift_feet(Walker& walker, double dt) {
  walker.next_step -= dt;
  if (walker.next_step > 0) return;
  walker.next_step = random_.uniform(3, 25);
  walker.ahead = random_.uniform(-0.08, 0.08);
  if (walker.stands && !walker.sits) walker.heading += random_.normal(0.15);
}

}  // namespace parhelion::test

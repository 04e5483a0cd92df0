#include "arm_task.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace robot {
namespace {

constexpr double kHandSpeed = 0.15, kTurnSpeed = 0.6;  // m/s, rad/s
constexpr double kOpen = 0.05;                         // m, of each finger
constexpr double kBefore = 0.15;                       // m before the thing
constexpr double kRaised = 0.40;                       // m that it is lifted: over a container's rim
constexpr double kLowered = 0.06;                      // m over the floor, when it is let go
constexpr double kCarried = 0.46;                      // m from the turret's axis
constexpr double kFollows = 0.06, kThere = 0.012;      // rad or m between target and encoder
constexpr double kStandsStill = 0.4, kSlowest = 25;    // s

double nearer(double from, double to, double step) { return from + std::clamp(to - from, -step, step); }

double angle_of(const Point2& p) { return std::atan2(p.y, p.x); }
double range_of(const Point2& p) { return std::hypot(p.x, p.y); }

double apart(const ArmPosture& a, const ArmPosture& b) {
  return std::max({std::abs(a.turret - b.turret), std::abs(a.shoulder - b.shoulder),
                   std::abs(a.elbow - b.elbow), std::abs(a.wrist - b.wrist)});
}

}  // namespace

ArmTask::ArmTask(const Plan& plan) : plan_(plan) {}

std::string ArmTask::phase() const {
  constexpr std::array<const char*, 11> names{"rises",   "comes before the thing",
                                              "reaches", "closes",
                                              "lifts",   "swings",
                                              "lowers",  "opens",
                                              "leaves",  "done",
                                              "given up"};
  const std::string name = names.at(static_cast<std::size_t>(phase_));
  return phase_ == Phase::given_up ? name + ": " + names.at(static_cast<std::size_t>(stuck_in_)) : name;
}

double ArmTask::release_range() const {
  constexpr double kStep = 0.01;  // m
  const double grip = plan_.thing_height - plan_.grip_below, middle = range_of(plan_.container);
  // Leaves one step, so that the arm is never fully stretched.
  const auto reaches = [&](double range) {
    return reach_for(range + kStep, grip + kRaised, 0, 0) && reach_for(range + kStep, grip + kLowered, 0, 0);
  };
  for (double nearer = 0; nearer <= plan_.container_room; nearer += kStep)
    if (reaches(middle - nearer)) return middle - nearer;
  return middle;
}

ArmTask::Goal ArmTask::goal_of(Phase phase) const {
  const double grip = plan_.thing_height - plan_.grip_below;
  const double to_thing = range_of(plan_.thing), to_container = release_range();
  const double thing = angle_of(plan_.thing), container = angle_of(plan_.container);
  switch (phase) {
    case Phase::rise:
      return {kCarried, grip + kRaised, thing, kOpen};
    case Phase::before:
      return {to_thing - kBefore, grip, thing, kOpen};
    case Phase::reach:
      return {to_thing, grip, thing, kOpen};
    case Phase::close:
      return {to_thing, grip, thing, plan_.closed};
    case Phase::lift:
      return {kCarried, grip + kRaised, thing, plan_.closed};
    case Phase::swing:
      return {to_container, grip + kRaised, container, plan_.closed};
    case Phase::lower:
      return {to_container, grip + kLowered, container, plan_.closed};
    case Phase::open:
      return {to_container, grip + kLowered, container, kOpen};
    default:
      return {to_container - kBefore, grip + kRaised, container, kOpen};
  }
}

bool ArmTask::has_come(const ArmPosture& encoders, double dt) {
  const Goal goal = goal_of(phase_);
  if (phase_ == Phase::close || phase_ == Phase::open) {
    still_ = std::abs(encoders.gripper - fingers_) < 5e-4 ? still_ + dt : 0;
    if (still_ == 0) fingers_ = encoders.gripper;
    return still_ > kStandsStill && in_phase_ > 2 * kStandsStill;
  }
  const auto target = reach_for(goal.reach, goal.z, goal.turret, 0);
  return target && apart(*target, encoders) < kThere;
}

std::optional<ArmPosture> ArmTask::command(const ArmPosture& encoders, double dt) {
  if (phase_ == Phase::done || phase_ == Phase::given_up) return std::nullopt;
  if (!started_) {
    started_ = true;
    hand_ = {kCarried, goal_of(Phase::rise).z, encoders.turret, kOpen};
  }
  in_phase_ += dt;
  if (has_come(encoders, dt)) {
    phase_ = static_cast<Phase>(static_cast<int>(phase_) + 1);
    in_phase_ = still_ = 0;
    if (phase_ == Phase::done) return std::nullopt;
  }
  const auto now = reach_for(hand_.reach, hand_.z, hand_.turret, hand_.gripper);
  const Goal goal = goal_of(phase_);
  const bool follows = now && (phase_ == Phase::rise || apart(*now, encoders) < kFollows);
  if (follows) {
    hand_.reach = nearer(hand_.reach, goal.reach, kHandSpeed * dt);
    hand_.z = nearer(hand_.z, goal.z, kHandSpeed * dt);
    hand_.turret = nearer(hand_.turret, goal.turret, kTurnSpeed * dt);
  }
  hand_.gripper = goal.gripper;
  const auto target = reach_for(hand_.reach, hand_.z, hand_.turret, hand_.gripper);
  if (!target || in_phase_ > kSlowest) {
    stuck_in_ = phase_;
    phase_ = Phase::given_up;
    return std::nullopt;
  }
  return target;
}

}  // namespace robot

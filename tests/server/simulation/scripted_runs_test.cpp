// Scripted runs with events known from geometry and kinematics: precision, recall and onset. A run's expected
// events are complete: any other event is wrong.
#include "scripted_runs.hpp"

#include <algorithm>

#include "server/simulation/bodies/near_miss.hpp"
#include "tests/degree.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;
constexpr double kPause = 0.25;                   // s, of a stop and of a contact's end
constexpr double kFront = 0.25, kPathSide = 0.2;  // m, of the robot's outline
constexpr double kWarning = 2.0;                  // s before a collision
constexpr double kZoneEdge = 0.05;                // m outside before a zone or a door's space counts as left
constexpr double kRelease = 0.02;                 // m in addition to the margin where a contact ends
constexpr double kOpened = 10 * kDegree, kClosed = 3 * kDegree;

/// Straight along x from x0 at v until `until`, then it stands.
auto straight(double x0, double y, double v, double until, double sigma = 0) {
  return [=](double t) -> std::optional<RealRobotState> {
    RealRobotState state = real_at(x0 + v * std::min(t, until), y, 0, {t <= until ? v : 0, 0, 0});
    state.sigma = sigma;
    return state;
  };
}

/// Accelerates to v with a from t = 0.5 s, holds it for `hold`, and decelerates.
Run trapezoid(double a, double v, double hold, bool turns) {
  const double up = 0.5, down = up + v / a + hold, end = down + v / a;
  const double start = turns ? 0.10 : 0.05, stop = turns ? 0.04 : 0.02;
  Run run{.name = "movement", .duration = end + 1};
  run.robot_at = [=](double t) {
    const double speed = std::clamp(std::min((t - up) * a, (end - t) * a), 0.0, v);
    return real_at(0, 0, 0, turns ? Twist2{0, 0, speed} : Twist2{speed, 0, 0});
  };
  run.expected = {{EventKind::movement_started, up + start / a},
                  {EventKind::movement_stopped, end - stop / a + kPause}};
  return run;
}

/// Pitch or roll grows at a rate, slow enough for two seconds to the limit, up to `max_angle`, and stays.
Run tilt(bool pitch, double rate, double max_angle) {
  const AttitudeLimits limits;
  const double warning = pitch ? limits.pitch_warning : limits.roll_warning;
  const double limit = pitch ? limits.pitch_limit : limits.roll_limit;
  const double size = std::abs(rate);
  Run run{.name = pitch ? "pitch" : "roll", .duration = max_angle / size + 0.5};
  run.limits = true;
  run.robot_at = [=](double t) {
    RealRobotState state = real_at(0, 0);
    const double angle = std::copysign(std::min(size * t, max_angle), rate);
    const Eigen::Vector3d axis = pitch ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
    state.T_map_base = Transform<Map, Base>(Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)), {0, 0, 0});
    state.attitude_known = true;
    return state;
  };
  run.expected = {{pitch ? EventKind::pitch_warning : EventKind::roll_warning, warning / size}};
  if (max_angle > limit)
    run.expected.push_back({pitch ? EventKind::pitch_limit : EventKind::roll_limit, limit / size});
  // One second before the limit would be reached at this rate; more than half of the margin is used up then.
  run.expected.push_back({EventKind::tipping_predicted, limit / size - 1});
  return run;
}

Run yaw_rate(double acceleration) {
  const AttitudeLimits limits;
  const double a = std::abs(acceleration);
  Run run{.name = "yaw rate", .duration = limits.yaw_rate_limit / a + 0.5};
  run.limits = true;
  run.robot_at = [=](double t) { return real_at(0, 0, acceleration * t * t / 2, {0, 0, acceleration * t}); };
  run.expected = {{EventKind::movement_started, 0.10 / a},
                  {EventKind::yaw_rate_warning, limits.yaw_rate_warning / a},
                  {EventKind::yaw_rate_limit, limits.yaw_rate_limit / a}};
  return run;
}

Run tips_over(double rate) {
  Run run = tilt(false, rate, std::numbers::pi / 2);
  run.name = "tips over";
  run.limits = false;
  run.expected = {{EventKind::tipped_over, std::numbers::pi / 3 / std::abs(rate)}};
  return run;
}

Zone box_zone(const std::string& name, double x0, double x1) {
  return {name, {{x0, -1}, {x1, -1}, {x1, 1}, {x0, 1}}, -1, 2};
}

/// Moves along x at v from x = 0 through zones.
Run through_zones(double v, const std::vector<Zone>& zones) {
  Run run{.name = "zones", .duration = 4 / v};
  run.options.zones = zones;
  run.robot_at = straight(0, 0, v, 1e9);
  run.expected = {{EventKind::movement_started, 0}};
  for (const Zone& zone : zones) {
    const double in = zone.outline[0].x(), out = zone.outline[1].x();
    run.expected.push_back({EventKind::zone_entered, std::max(0.0, in / v), zone.name});
    if ((out + kZoneEdge) / v < run.duration)
      run.expected.push_back({EventKind::zone_left, (out + kZoneEdge) / v, zone.name});
  }
  return run;
}

/// Its pose is lost at one second, inside a zone and moving, and comes back a second later.
Run loses_its_pose(double v) {
  Run run{.name = "pose lost", .duration = 3};
  run.options.zones = {box_zone("all", -5, 9)};
  run.robot_at = [=](double t) -> std::optional<RealRobotState> {
    if (t > 1 && t < 2) return std::nullopt;
    return real_at(v * t, 0, 0, {v, 0, 0});
  };
  run.expected = {{EventKind::movement_started, 0},
                  {EventKind::zone_entered, 0, "all"},
                  {EventKind::movement_stopped, 1 + kStep / 2},
                  {EventKind::zone_left, 1 + kStep / 2, "all"},
                  {EventKind::movement_started, 2},
                  {EventKind::zone_entered, 2, "all"}};
  return run;
}

/// Into the wall of a room of 10 m at v, where it stands for `stands` s and then drives back.
Run hits_a_wall(double v, double sigma, double stands, bool back) {
  const double gap = 5 - kFront, contact = (gap - sigma) / v;
  const double until = contact + 2 * kStep;
  Run run{.name = "wall", .duration = until + stands + (back ? 1.0 : 0.0)};
  run.model = room(10);
  run.robot_at = [=](double t) -> std::optional<RealRobotState> {
    const double returns = back ? std::max(0.0, t - until - stands) : 0;
    RealRobotState state =
        real_at(v * (std::min(t, until) - returns), 0, 0, {returns > 0 ? -v : (t <= until ? v : 0), 0, 0});
    state.sigma = sigma;
    return state;
  };
  run.expected = {{EventKind::movement_started, 0},
                  {EventKind::collision_predicted, contact - kWarning, "wall 1"},
                  {EventKind::contact_started, contact, "wall 1"}};
  if (stands > kPause) run.expected.push_back({EventKind::movement_stopped, until + kPause});
  const double leaves = until + stands + (kRelease + v * 2 * kStep) / v;
  for (double t = contact + 1; t < (back ? leaves : run.duration); t += 1)
    run.expected.push_back({EventKind::contact_continues, t, "wall 1"});
  if (back) {
    if (stands > kPause) run.expected.push_back({EventKind::movement_started, until + stands});
    run.expected.push_back({EventKind::contact_ended, leaves + kPause, "wall 1"});
  }
  return run;
}

Run along_a_wall(double v, double gap) {
  Run run{.name = "along a wall", .duration = 3};
  run.model = room(10);
  run.robot_at = straight(-2, 5 - kPathSide - gap, v, 1e9);
  run.expected = {{EventKind::movement_started, 0}};
  return run;
}

/// The floor under a crate is removed: it falls by h.
Run crate_falls(double h) {
  const double away = 0.2, g = 9.81, lands = away + std::sqrt(2 * h / g);
  Run run{.name = "fall", .duration = lands + 0.6};
  const auto floor_at = [](double z) {
    SemanticModel model;
    model.entities.push_back(model_box("floor", EntityLabel::floor, {0, 0, z - 0.05}, {20, 20, 0.1}));
    return model;
  };
  run.model = floor_at(0);
  run.options.building_bodies = 10;
  run.robot_at = [](double) { return std::optional<RealRobotState>(); };
  run.before_step = [=](Simulation& simulation, double t) {
    if (t == kStep) spawn(simulation, agent("crate", AgentKind::box, 0, 0));
    if (std::lround(t / kStep) != std::lround(away / kStep) + 1) return;
    ASSERT_TRUE(simulation.set_building(floor_at(-h)).ok());
  };
  run.expected = {{EventKind::movement_started, away + 0.05 / g, "", "crate"},
                  {EventKind::fell, lands, "", "crate"}};
  run.uncounted = EventKind::movement_stopped;
  return run;
}

SemanticModel stairway(int steps, double rise, double tread) {
  SemanticModel model;
  model.entities.push_back(model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {20, 20, 0.1}));
  for (int i = 0; i < steps; ++i) {
    const double top = rise * (i + 1);
    model.entities.push_back(model_box("step " + std::to_string(i + 1), EntityLabel::stairs,
                                       {1 + (i + 0.5) * tread, 0, top / 2}, {tread, 2, top}));
  }
  return model;
}

/// base_link on the line of the nosings, at v along x; at `turns` s it reverses, and again at twice that.
Run climbs(int steps, double rise, double tread, double v, double turns = 1e9) {
  const double end = 1 + steps * tread;
  const double all = turns < 1e9 ? 3 * turns : end / v;
  Run run{.name = "stairs", .duration = all - kStep};
  run.model = stairway(steps, rise, tread);
  run.on_stairs = true;
  run.robot_at = [=](double t) {
    const double moving_time = t < turns ? t : (t < 2 * turns ? 2 * turns - t : t - 2 * turns);
    const double x = v * moving_time, s = t < turns || t >= 2 * turns ? 1 : -1;
    RealRobotState state = real_at(0, 0, 0, {s * v, 0, 0});
    state.T_map_base = Transform<Map, Base>::planar(x, 0, 0, std::max(0.0, rise + (x - 1) * rise / tread));
    return state;
  };
  run.expected = {{EventKind::movement_started, 0}};
  for (int i = 0; i < steps; ++i) {
    const double t = (1 + i * tread) / v;
    const std::string step = "step " + std::to_string(i + 1);
    if (t < std::min(turns, run.duration)) run.expected.push_back({EventKind::step_climbed, t, step});
    if (turns < 1e9 && t < turns) run.expected.push_back({EventKind::step_climbed, 2 * turns + t, step});
  }
  return run;
}

/// A wall across a room of 12 m at x = 2, with a door 1 m wide at y = 0, drawn closed, hinged at y = -0.5,
/// that opens towards -x.
SemanticModel gateway() {
  SemanticModel model = room(12);
  model.entities.push_back(model_box("wall a", EntityLabel::wall, {2, -3.25, 1.25}, {0.1, 5.5, 2.5}));
  model.entities.push_back(model_box("wall b", EntityLabel::wall, {2, 3.25, 1.25}, {0.1, 5.5, 2.5}));
  ModelEntity door = model_box("door", EntityLabel::door, {2, 0, 1}, {1, 0.04, 2}, std::numbers::pi / 2);
  door.hinge = Hinge{{-0.5, 0}, 0, std::numbers::pi / 2, 0};
  model.entities.push_back(door);
  model.entities.push_back(
      model_box("free space of door", EntityLabel::free_space, {2, 0, 1}, {0.3, 1.0, 2.0}));
  return model;
}
constexpr double kSpaceBegins = 1.85, kSpaceEnds = 2.15, kLeaf = 1.98;

/// A real door measured by sensors: closed until 0.5 s, then to 40 degrees and back at a rate, `times` times.
Run door_turns(double rate, int times) {
  const double top = 40 * kDegree, period = 2 * top / rate, start = 0.5;
  Run run{.name = "door", .duration = start + period * times + 0.2};
  run.model = gateway();
  run.robot_at = [](double) { return std::optional<RealRobotState>(); };
  run.before_step = [=](Simulation& simulation, double t) {
    const double phase = std::fmod(std::max(0.0, t - start), period);
    const bool over = t - start >= period * times;
    simulation.observe_door("door", over ? 0 : std::min(phase, period - phase) * rate);
  };
  for (int i = 0; i < times; ++i) {
    run.expected.push_back({EventKind::door_opened, start + i * period + kOpened / rate, "door", "door"});
    run.expected.push_back(
        {EventKind::door_closed, start + (i + 1) * period - kClosed / rate, "door", "door"});
  }
  return run;
}

/// Through the opening of an open door; `opening`: none if unknown.
Run passes_a_door(double v, double y, std::optional<double> opening) {
  Run run{.name = "passes a door", .duration = 3 / v};
  run.model = gateway();
  run.robot_at = straight(0, y, v, 1e9);
  run.before_step = [=](Simulation& simulation, double) { simulation.observe_door("door", opening); };
  run.expected = {{EventKind::movement_started, 0},
                  {EventKind::door_space_entered, (kSpaceBegins - kFront) / v, "door"},
                  {EventKind::door_space_left, (kSpaceEnds + kZoneEdge + kFront) / v, "door"}};
  // Past the opening's side at y = 0.5, and past a leaf that is not completely open.
  const auto leaves = [&](const Eigen::Vector2d& last, double gap) {
    const double along = std::sqrt(NearMissWatch::kAway * NearMissWatch::kAway - gap * gap);
    return (last.x() + along + kFront) / v + NearMissWatch::kHold;
  };
  if (const double gap = 0.5 - kPathSide - y; gap < NearMissWatch::kGap)
    run.expected.push_back({EventKind::near_miss, leaves({2.05, 0.5}, gap), "wall b"});
  if (!opening) return run;
  const double c = std::cos(*opening), s = std::sin(*opening);
  const Eigen::Vector2d tip(2 - s + 0.02 * c, -0.5 + c + 0.02 * s), foot(2 + 0.02 * c, -0.5 + 0.02 * s);
  const double right = y - kPathSide;
  if (right - tip.y() < NearMissWatch::kGap)
    run.expected.push_back({EventKind::near_miss, leaves(foot, right - foot.y()), "door"});
  return run;
}

Run hits_a_closed_door(double v, double sigma) {
  const double contact = (kLeaf - kFront - sigma + 2) / v, until = contact + 2 * kStep;
  Run run{.name = "closed door", .duration = until + 0.5};
  run.model = gateway();
  run.robot_at = straight(-2, 0, v, until, sigma);
  run.before_step = [](Simulation& simulation, double) { simulation.observe_door("door", 0); };
  run.expected = {{EventKind::movement_started, 0},
                  {EventKind::collision_predicted, contact - kWarning, "door"},
                  {EventKind::door_space_entered, (kSpaceBegins - kFront + 2) / v, "door"},
                  {EventKind::contact_started, contact, "door"},
                  {EventKind::movement_stopped, until + kPause}};
  return run;
}

std::vector<Run> general_runs() {
  return {trapezoid(0.5, 1.0, 1, false),
          trapezoid(1.3, 0.8, 0.4, false),
          trapezoid(0.25, 0.4, 2, false),
          trapezoid(2.0, 1.5, 0.2, false),
          trapezoid(0.7, 1.2, 0.5, true),
          trapezoid(3.0, 2.0, 0.3, true),
          tilt(true, 0.25, 0.65),
          tilt(true, -0.2, 0.7),
          tilt(false, 0.21, 0.55),
          tilt(false, -0.19, 0.6),
          tilt(true, 0.3, 0.4),
          tilt(false, -0.22, 0.35),
          yaw_rate(1.1),
          yaw_rate(-0.8),
          tips_over(0.9),
          tips_over(-1.7),
          through_zones(1.0, {box_zone("a", 1, 2)}),
          through_zones(0.7, {box_zone("a", 0.5, 2), box_zone("b", 1.2, 3)}),
          through_zones(1.6, {box_zone("around the start", -1, 1.5)}),
          through_zones(0.45, {box_zone("a", 0.9, 1.1), box_zone("at the end", 3, 9)}),
          loses_its_pose(0.6),
          loses_its_pose(1.1),
          hits_a_wall(1.0, 0, 1.6, false),
          hits_a_wall(0.5, 0.03, 0.7, true),
          hits_a_wall(1.5, 0.05, 2.4, true),
          hits_a_wall(0.8, 0.01, 0.1, true),
          along_a_wall(1.0, 0.1),
          crate_falls(0.3),
          crate_falls(0.6),
          crate_falls(1.1)};
}

std::vector<Run> stairs_and_doors() {
  return {climbs(5, 0.17, 0.30, 1.0),
          climbs(8, 0.17, 0.28, 0.5),
          climbs(3, 0.15, 0.32, 0.3),
          climbs(10, 0.18, 0.27, 0.8),
          climbs(4, 0.12, 0.40, 0.6),
          climbs(6, 0.20, 0.25, 0.45),
          climbs(2, 0.16, 0.30, 0.2),
          climbs(5, 0.17, 0.30, 0.7, 2.6),
          climbs(7, 0.15, 0.3, 1.1, 2.1),
          climbs(4, 0.17, 0.29, 0.4, 4.0),
          door_turns(0.4, 1),
          door_turns(0.9, 2),
          door_turns(0.25, 1),
          door_turns(0.6, 3),
          passes_a_door(1.0, 0, 85 * kDegree),
          passes_a_door(0.6, 0.15, 80 * kDegree),
          passes_a_door(0.4, 0.05, 90 * kDegree),
          passes_a_door(0.8, 0, std::nullopt),
          hits_a_closed_door(0.5, 0.02),
          hits_a_closed_door(0.9, 0)};
}

TEST(ScriptedRuns, ThirtyOfMovementAttitudeZonesWallsAndFalls) {
  ASSERT_EQ(general_runs().size(), 30U);
  expect_good(general_runs(), "of movement, attitude, zones, walls, falls");
}

TEST(ScriptedRuns, TwentyOnStairsAndAtDoors) {
  ASSERT_EQ(stairs_and_doors().size(), 20U);
  expect_good(stairs_and_doors(), "on stairs and at doors");
}

}  // namespace
}  // namespace parhelion::simulation

// Triggered devices, readings of sources, radio and battery, against closed formulas.
#include "server/simulation/events/hazards.hpp"

#include "robots_world.hpp"
#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/building/building.hpp"
#include "server/simulation/building/doors.hpp"
#include "server/simulation/robots/robot_supply.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

Hazard device(const std::string& name) {
  Hazard hazard;
  hazard.name = name;
  return hazard;
}

Hazard source(HazardKind kind, const Eigen::Vector3d& position, double strength) {
  Hazard hazard = device("source");
  hazard.kind = kind;
  hazard.position = position;
  hazard.strength = strength;
  return hazard;
}

template <class Motion>
std::vector<Event> set_off(Simulation& simulation, double duration, Motion robot_at) {
  return only(follow(simulation, duration, robot_at), EventKind::hazard_triggered);
}

double reading_at(Simulation& simulation, double x, double y) {
  run(simulation, 2 * kStep, real_at(x, y));
  HazardReading reading;
  EXPECT_TRUE(simulation.hazard_reading(reading));
  EXPECT_EQ(reading.values.size(), 1U);
  return reading.values.empty() ? -1 : reading.values[0].value;
}

TEST(Hazards, NearnessIsMeasuredToTheOutlineAndReportedOnce) {
  SimulationOptions options;
  options.hazards = {device("mine")};
  options.hazards[0].position = {3, 0, 0};
  options.hazards[0].nearness = 0.5;
  Simulation simulation = make({}, options);
  const auto events = set_off(simulation, 4, [](double t) { return real_at(t, 0, 0, {1, 0, 0}); });
  ASSERT_EQ(events.size(), 1U);
  EXPECT_NEAR(since_start(events[0]), 3 - 0.5 - 0.25, 1.001 * kStep);
  EXPECT_EQ(events[0].subject, "mine");
  EXPECT_EQ(events[0].object, "pioneer");
  EXPECT_EQ(events[0].text, "nearness");
  EXPECT_EQ(events[0].pair, PairKind::real_virtual);
}

TEST(Hazards, ATimerTriggersADevice) {
  SimulationOptions options;
  options.hazards = {device("clock")};
  options.hazards[0].delay = 1.5;
  Simulation simulation = make({}, options);
  const auto events = set_off(simulation, 2, [](double) { return real_at(0, 0); });
  ASSERT_EQ(events.size(), 1U);
  EXPECT_NEAR(since_start(events[0]), 1.5, 1.001 * kStep);
}

TEST(Hazards, OnlyALargeMomentumChangeIsAShock) {
  // A crate hit at 1 m/s by a kinematic robot has that speed at once: m v.
  AgentDefinition crate = agent("crate", AgentKind::box, 1.5, 0);
  crate.size = {0.4, 0.4, 0.4};
  const double momentum = agent_form(crate).mass;
  for (const double threshold : {0.7 * momentum, 1.3 * momentum}) {
    SimulationOptions options;
    options.hazards = {device("case")};
    options.hazards[0].agent = "crate";
    options.hazards[0].shock = threshold;
    Simulation simulation = make(floor_of(20), options);
    spawn(simulation, crate);
    const auto events = set_off(simulation, 2, [](double t) { return real_at(t, 0, 0, {1, 0, 0}); });
    ASSERT_EQ(events.size(), threshold < momentum ? 1U : 0U);
    if (events.empty()) continue;
    EXPECT_NEAR(since_start(events[0]), 1.5 - 0.2 - 0.25, 2.001 * kStep);
    EXPECT_EQ(events[0].text, "shock");
  }
}

TEST(Hazards, TiltTriggersADevice) {
  SimulationOptions options;
  options.hazards = {device("case")};
  options.hazards[0].agent = "post";
  options.hazards[0].tilt = 0.5;
  AgentDefinition post = agent("post", AgentKind::box, 1, 0);
  post.size = {0.2, 0.2, 1.2};
  Simulation simulation = make(floor_of(20), options);
  spawn(simulation, post);
  // Pushed under its middle at speed: it falls over.
  const auto events = set_off(simulation, 3, [](double t) {
    return real_at(std::min(t, 1.5), 0, 0, {1, 0, 0});
  });
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].text, "tilt");
  EXPECT_GE(events[0].value, 0.5);
  EXPECT_LT(events[0].value, 0.6);
}

TEST(Hazards, DoseFallsWithSquaredDistanceAndBehindWalls) {
  SimulationOptions options;
  options.hazards = {source(HazardKind::radiation, {0, 0, 0.5}, 100)};
  Simulation open = make({}, options);
  EXPECT_NEAR(reading_at(open, 2, 0), 100 / 4.0, 1e-9);
  EXPECT_NEAR(reading_at(open, 4, 3), 100 / 25.0, 1e-9);
  Simulation walled = make(room(6), options);
  // The wall is 0.2 m thick: 0.2 / 0.048 halvings.
  EXPECT_NEAR(reading_at(walled, 4, 0), 100 / 16.0 * std::exp2(-0.2 / 0.048), 1e-9);
}

TEST(Hazards, GasSpreadsAroundWalls) {
  SemanticModel model = floor_of(30);
  // A wall from y = -6 to 1 m between leak and robot: the path leads around its end at (2, 1).
  model.entities.push_back(model_box("wall", EntityLabel::wall, {2, -2.5, 1}, {0.2, 7, 2}));
  SimulationOptions options;
  options.hazards = {source(HazardKind::gas, {0, 0, 0.3}, 1000)};
  options.hazards[0].reach = 2;
  Simulation simulation = make(model, options);
  EXPECT_NEAR(reading_at(simulation, -3, 0), 1000 * std::exp(-1.5), 1e-6) << "straight";
  const double path_length = std::hypot(1.9, 1) + 0.2 + std::hypot(1.9, 1);
  const double behind = reading_at(simulation, 4, 0);
  EXPECT_LT(behind, 1000 * std::exp(-path_length / 2));
  EXPECT_GT(behind, 1000 * std::exp(-(1.08 * path_length + 0.5) / 2))
      << "a grid's way is at most 8 % and two cells longer";
}

TEST(Hazards, GasPassesNoThinObliqueOrClosedWall) {
  // A room rotated by 45 degrees, with walls of 2 cm through the corners of the grid's cells.
  SemanticModel model = floor_of(30);
  const double side = 4, yaw = std::numbers::pi / 4;
  for (int i = 0; i < 4; ++i) {
    const double turn = yaw + i * std::numbers::pi / 2;
    const double x = side / 2 * std::cos(turn), y = side / 2 * std::sin(turn);
    model.entities.push_back(
        model_box("wall " + std::to_string(i), EntityLabel::wall, {x, y, 1}, {0.02, side, 2}, turn));
  }
  SimulationOptions options;
  options.hazards = {source(HazardKind::gas, {0, 0, 0.3}, 1000)};
  options.hazards[0].reach = 10;
  Simulation simulation = make(model, options);
  EXPECT_NEAR(reading_at(simulation, 0.5, 0.5), 1000 * std::exp(-std::hypot(0.5, 0.5) / 10), 1e-6);
  for (const auto& [x, y] : {std::pair(3.2, 0.0), {0.0, -3.3}, {2.1, 2.1}, {-1.8, 1.9}, {9.0, 4.0}})
    EXPECT_EQ(reading_at(simulation, x, y), 0) << x << ", " << y;
}

TEST(Hazards, WithoutSourcesReadingsAreZero) {
  SimulationOptions options;
  options.hazards = {device("clock")};
  options.hazards[0].delay = 1;
  Simulation simulation = make({}, options);
  run(simulation, 0.1, real_at(0, 0));
  HazardReading reading;
  EXPECT_FALSE(simulation.hazard_reading(reading));
}

/// Reference implementation of crossing(): the fraction of sample points on the line that are in a box.
TEST(Hazards, WallThicknessEqualsSamplingAlongTheLine) {
  const SemanticModel model = room(6);
  const auto building = Simulation::prepare_building(model);
  ASSERT_TRUE(building.ok());
  Physics physics(kStep);
  const std::vector<Door> doors = (*building)->enter(physics, 1, {3, {}});
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d a(std::sin(i), std::cos(2.0 * i), 0.5 + 0.01 * i),
        b(8 * std::cos(i), 8 * std::sin(3.0 * i), 1);
    constexpr int samples = 20'000;
    double inside = 0;
    for (int n = 0; n < samples; ++n) {
      const Eigen::Vector3d p = a + (n + 0.5) / samples * (b - a);
      for (const ModelEntity& entity : model.entities) {
        const Eigen::Vector3d q = entity.T_map_body.inverse() * p;
        inside += (q.cwiseAbs().array() < entity.size.array() / 2).all() ? 1 : 0;
      }
    }
    const double expected = inside / samples * (b - a).norm();
    const double found = crossing(**building, doors, a, b).thickness;
    // Intersections shorter than 5 mm do not count.
    EXPECT_NEAR(found, expected, 0.005 * 2 + (b - a).norm() / samples * 4) << i;
  }
}

TEST(Radio, PowerFollowsFriisLogDistanceAndWallLoss) {
  Radio radio;
  // 2.4 GHz, 1 m: 40.05 dB; each tenfold of distance 20 dB more.
  EXPECT_NEAR(received_power(radio, 1, 0), 20 - 40.05, 0.01);
  EXPECT_NEAR(received_power(radio, 100, 0), 20 - 80.05, 0.01);
  EXPECT_NEAR(received_power(radio, 100, 2), 20 - 96.05, 0.01);
}

TEST(Radio, ARobotBehindAWallLosesRadioAndStops) {
  SemanticModel model = floor_of(60);
  model.entities.push_back(model_box("wall", EntityLabel::wall, {-4, 3, 1}, {8, 0.2, 2}));
  SimulationOptions options = with_robots({"rover"});
  options.radio = Radio{};
  options.radio->position = {-3, 6, 1};
  // Free sight at 8 m is 61.9 dB of loss; through the wall 8 dB more.
  options.radio->sensitivity = 20 - 40.05 - 20 * std::log10(8.0) - 4;
  Simulation simulation = make(model, options);
  spawn(simulation, articulated("r", "rover", 4, 0, std::numbers::pi));
  drive(simulation, "r", {0.6, 0, 0}, 12);
  const auto events = simulation.take_events();
  const auto lost = only(events, EventKind::radio_lost);
  ASSERT_EQ(lost.size(), 1U);
  // The line from the console to its top passes the wall's end at (0, 3.1) or (0, 2.9).
  EXPECT_NEAR(lost[0].position.x(), 3, 0.3);
  EXPECT_EQ(count(events, EventKind::radio_restored), 0U);
  EXPECT_LT(motion(simulation, "r").velocity.norm(), 1e-3) << "out of range";
}

TEST(Battery, IdleAndDrivingDrainItUntilTheRobotStops) {
  SimulationOptions options = with_robots({"rover"});
  options.battery = Battery{};
  options.battery->capacity = 100;
  Simulation simulation = make(floor_of(40), options);
  spawn(simulation, articulated("r", "rover", 0, 0));
  run(simulation, 2);  // 20 W of idling
  EXPECT_EQ(count(simulation.take_events(), EventKind::battery_low), 0U);
  const double mass = 24.4, v = 0.5;
  drive(simulation, "r", {v, 0, 0}, 6);
  const auto events = simulation.take_events();
  const auto low = only(events, EventKind::battery_low), empty = only(events, EventKind::battery_empty);
  ASSERT_EQ(low.size(), 1U);
  ASSERT_EQ(empty.size(), 1U);
  // 40 J used idling; acceleration takes m v^2 / 2, then rolling continues.
  const double power = 20 + 0.03 * mass * 9.81 * v / 0.6, kinetic = mass * v * v / 2 / 0.6;
  EXPECT_NEAR(since_start(low[0]), 2 + (80 - 40 - kinetic) / power, 0.25);
  EXPECT_NEAR((empty[0].stamp - low[0].stamp).seconds(), 20 / power, 0.05);
  EXPECT_NEAR(low[0].value, 0.2, 0.002);
  EXPECT_LT(motion(simulation, "r").velocity.norm(), 1e-3);
}

TEST(Battery, AnEmptyBatteryHoldsTheArmInPlace) {
  SimulationOptions options = with_robots({"crawler"});
  options.battery = Battery{};
  options.battery->idle = 100;
  options.battery->capacity = 50;
  Simulation simulation = make(floor_of(20), options);
  spawn(simulation, articulated("r", "crawler", 0, 0));
  Joints wanted;
  wanted.names = {"shoulder_joint"};
  wanted.positions = {0.6};
  ASSERT_TRUE(simulation.joint_command("r", wanted).ok());
  run(simulation, 0.6);
  ASSERT_EQ(count(simulation.take_events(), EventKind::battery_empty), 1U);
  const auto shoulder = [&] {
    const Joints& joints = motion(simulation, "r").joints;
    const auto at = std::find(joints.names.begin(), joints.names.end(), "shoulder_joint");
    return joints.positions[static_cast<std::size_t>(at - joints.names.begin())];
  };
  run(simulation, 0.4);
  const double there = shoulder();
  run(simulation, 3);
  EXPECT_NEAR(shoulder(), there, 0.01);
  EXPECT_LT(std::abs(there), 0.5) << "not where it was to go";
  const Status refused = simulation.joint_command("r", wanted);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("battery"), std::string::npos);
  EXPECT_EQ(simulation.supply_of("r").battery_left, 0);
  EXPECT_TRUE(simulation.supply_of("r").battery_empty);
}

}  // namespace
}  // namespace parhelion::simulation

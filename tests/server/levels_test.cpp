// Levels 1 and 2: the trainee's robot is simulated, and its sensors speak as a real robot's do.
#include <gmock/gmock.h>

#include <atomic>
#include <fstream>
#include <set>
#include <thread>

#include "server/loop.hpp"
#include "server/replay.hpp"
#include "server/wall_clock.hpp"
#include "tests/server/level_1.hpp"
#include "tests/server/same_bytes.hpp"
#include "tests/server/tick_fixture.hpp"

namespace parhelion {
namespace {

using test::level_1;
using testing::HasSubstr;

Message teleop_at(double t, double vx, double wz = 0) {
  const std::int64_t utime = test::start_us + static_cast<std::int64_t>(t * 1e6);
  return test::message(channel::teleop, utime, TwistCommand{SensorTime::from_utime(utime), {vx, 0, wz}});
}

class LevelsTest : public test::TickTest {
 protected:
  /// Until t (s after the start), with TELEOP at 20 Hz where it is given.
  void run(double until, std::optional<Twist2> twist = std::nullopt) {
    for (; time_ < until - 1e-9; time_ += 0.05) {
      if (twist) {
        feed(teleop_at(time_, twist->vx, twist->wz));
        continue;
      }
      outputs_.clear();
      advance(configuration_, teleop_at(time_, 0).arrival, *state_, outputs_, observer_);
      for (const Outputs::Entry& entry : outputs_.entries()) out_[entry.channel].push_back(entry.payload);
    }
  }
  const RobotMotion& motion() { return *state_->simulation.robot_motion("trainee"); }
  std::vector<Event> events(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::mr_events);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }

  double time_ = 0;
};

TEST_F(LevelsTest, SensorsOfASimulatedRobotSpeakAtTheirRatesAndTheServerTakesThemIn) {
  start(level_1());
  run(2);
  EXPECT_NEAR(static_cast<double>(out_[channel::scan].size()), 2 * 40, 2) << "of a UTM-30LX";
  EXPECT_NEAR(static_cast<double>(out_[channel::odometry].size()), 2 * 50, 3);
  EXPECT_NEAR(static_cast<double>(out_[channel::imu].size()), 2 * 100, 5);
  EXPECT_NEAR(static_cast<double>(out_[channel::pose_cov].size()), 2 * 50, 3);
  EXPECT_EQ(out_[channel::pose].size(), out_[channel::pose_cov].size());
  EXPECT_GE(out_[channel::bumper].size(), 19U);
  const auto robots = decoded<RobotMessage>(channel::robot);
  ASSERT_GE(robots.size(), 2U);
  const auto description = parse_robot_description(robots.front().yaml, "ROBOT");
  ASSERT_TRUE(description) << description.error().message;
  EXPECT_EQ(description->name, "trainee");
  // There is nothing to inject into what a simulated laser sees.
  EXPECT_EQ(out_[channel::mr_scan], out_[channel::scan]);
  EXPECT_EQ(out_[channel::mr_scan_info].size(), out_[channel::scan].size());
  EXPECT_TRUE(state_->real.has_value()) << "the server knows the pose by its own channels";
  EXPECT_EQ(events(EventKind::pose_recovered).size(), 1U);
  EXPECT_EQ(state_->tally.refused_inputs, 0U) << state_->tally.last_refusal;
}

TEST_F(LevelsTest, TheCameraAsksForAPictureOfWhereItIsAtItsRate) {
  start(level_1({test::agent("box_1", AgentKind::box, 0, 0)}));
  std::vector<Outputs::Frame> frames;
  for (int step = 1; step <= 480; ++step) {
    outputs_.clear();
    advance(configuration_, ArrivalTime{state_->simulation.next_step().ns}, *state_, outputs_, observer_);
    for (Outputs::Frame& frame : outputs_.frames()) frames.push_back(std::move(frame));
  }
  ASSERT_NEAR(static_cast<double>(frames.size()), 2 * 15, 1);
  EXPECT_EQ(state_->tally.frames_in, frames.size());
  const Outputs::Frame& last = frames.back();
  ASSERT_TRUE(last.exposure.has_value());
  EXPECT_TRUE(last.exposure->shows_carrier);
  EXPECT_EQ(last.exposure->noise, 1.5);
  EXPECT_EQ(last.exposure->sequence, frames.size());
  EXPECT_EQ(last.job.world.stamp.ns, last.job.image.stamp.ns) << "the world at the picture's own instant";
  std::set<std::string> shown;
  for (const auto& body : last.job.world.scene->bodies)
    for (const BodyState& there : last.job.world.bodies)
      if (there.id == body->id) shown.insert(body->entity);
  EXPECT_TRUE(shown.contains("box_1") && shown.contains("trainee"));
  const Eigen::Vector3d eye = last.job.T_map_optical.translation();
  EXPECT_NEAR((eye - Eigen::Vector3d(-2.1, 0, 0.6)).norm(), 0, 0.02);
  const Eigen::Vector3d forwards = last.job.T_map_optical.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(forwards.x(), 1, 1e-3);
}

TEST_F(LevelsTest, ScansAreOfTheBuildingWithTheLasersNoise) {
  start(level_1());
  run(1);
  const LaserDescription& laser = *configuration_.robot.laser;
  const auto T_map_laser = motion().T_map_base * laser.T_base_laser;
  const Scan scan = decoded<Scan>(channel::scan).back();
  ASSERT_EQ(scan.ranges.size(), static_cast<std::size_t>(laser.beams));
  std::vector<float> time;
  beam_times(laser, scan.ranges.size(), time);
  std::vector<RangeHit> exact(time.size());
  cast_building_exact({T_map_laser, T_map_laser}, {scan.angle_first, scan.angle_step, time}, test::room(), 30,
                      exact);
  double squares = 0, hits = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (std::isinf(exact[i].range)) {  // through a gap between two walls
      ASSERT_EQ(laser.convention.classify(scan.ranges[i]), BeamKind::no_return) << i;
      continue;
    }
    ++hits;
    ASSERT_NEAR(scan.ranges[i], exact[i].range, 6 * laser.noise_sigma + laser.quantization) << i;
    squares += std::pow(scan.ranges[i] - exact[i].range, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / hits), laser.noise_sigma, 0.3 * laser.noise_sigma);
}

TEST_F(LevelsTest, TeleopDrivesTheSimulatedRobotAndItsSilenceStopsIt) {
  start(level_1());
  run(0.5);
  run(4.5, Twist2{0.4, 0, 0});
  const double reached = motion().T_map_base.translation().x();
  EXPECT_NEAR(reached, -2 + 0.4 * 4, 0.15);
  const Odometry odometry = decoded<Odometry>(channel::odometry).back();
  EXPECT_NEAR(odometry.T_odom_base.translation().x(), 0.4 * 4, 0.3) << "drifts as wheels do";
  EXPECT_NE(odometry.T_odom_base.translation().x(), reached + 2);
  EXPECT_EQ(decoded<TwistCommand>(channel::mr_cmd).back().twist.vx, 0.4F);
  run(6.5);
  EXPECT_LT(motion().velocity.norm(), 0.01);
  EXPECT_EQ(decoded<TwistCommand>(channel::mr_cmd).back().twist.vx, 0);
  EXPECT_LT(motion().T_map_base.translation().x(), reached + 0.4 * 0.5 + 0.2);
  EXPECT_EQ(events(EventKind::movement_started).size(), 1U);
  EXPECT_EQ(events(EventKind::movement_stopped).size(), 1U);
}

TEST_F(LevelsTest, WhatStandsInTheWayIsSeenNamedAndHitAndTheBumperFeelsIt) {
  start(level_1({test::agent("box_1", AgentKind::box, 0, 0)}));
  run(0.5);
  const ScanInfo before = decoded<ScanInfo>(channel::mr_scan_info).back();
  EXPECT_TRUE(before.live);
  ASSERT_EQ(before.agents, std::vector<std::string>{"box_1"});
  const std::size_t middle = before.beam_agent.size() / 2;
  EXPECT_EQ(before.beam_agent[middle], 0);
  const Scan scan = decoded<Scan>(channel::scan).back();
  EXPECT_NEAR(scan.ranges[middle], 2 - 0.2 - configuration_.robot.laser->T_base_laser.translation().x(), 0.1);
  run(6, Twist2{0.5, 0, 0});
  const auto collisions = events(EventKind::collision_started);
  ASSERT_FALSE(collisions.empty());
  EXPECT_EQ(collisions.front().subject, "trainee");
  EXPECT_EQ(collisions.front().object, "box_1");
  bool bumped = false;
  for (const Joints& bumper : decoded<Joints>(channel::bumper))
    bumped = bumped || bumper.positions.at(0) == 1;
  EXPECT_TRUE(bumped);
}

TEST_F(LevelsTest, ARobotThatFallsIsNotLost) {
  Configuration configuration = level_1();
  ModelEntity ledge;
  ledge.name = "ledge";
  ledge.label = EntityLabel::floor;
  ledge.T_map_body = Transform<Map, Body>::planar(-2, 0, 0, 0.2);
  ledge.size = {2, 2, 0.4};
  configuration.model.entities.push_back(ledge);
  ledge.name = "floor";
  ledge.T_map_body = Transform<Map, Body>::planar(0, 0, 0, -0.05);
  ledge.size = {10, 8, 0.1};
  configuration.model.entities.push_back(ledge);
  start(std::move(configuration));
  run(4, Twist2{0.8, 0, 0});
  EXPECT_FALSE(events(EventKind::fell).empty());
  EXPECT_TRUE(events(EventKind::pose_lost).empty());
  EXPECT_TRUE(events(EventKind::relocalized).empty());
}

TEST_F(LevelsTest, AnAgentIsKeptOffTheTraineesRobotAndTheRobotItselfCanBeMoved) {
  start(level_1());
  run(0.2);
  AgentCommand command;
  command.request = 1;
  command.stamp = SensorTime::from_utime(test::start_us);
  command.agent = test::agent("box_1", AgentKind::box, -2, 0);
  const auto at = [this] { return teleop_at(time_ += 0.05, 0).arrival.utime(); };
  feed(test::message(channel::mr_agent_cmd, at(), command));
  EXPECT_EQ(events(EventKind::command_refused).size(), 1U);
  command.request = 2;
  command.action = AgentCommand::Action::move;
  command.agent = test::agent("trainee", AgentKind::robot, 2, 1);
  feed(test::message(channel::mr_agent_cmd, at(), command));
  EXPECT_EQ(events(EventKind::command_accepted).size(), 1U);
  run(1);
  EXPECT_NEAR(motion().T_map_base.translation().x(), 2, 0.05);
  feed(test::message("MR_AGENT_trainee_TELEOP", at(),
                     TwistCommand{SensorTime::from_utime(test::start_us), {1, 0, 0}}));
  EXPECT_THAT(state_->tally.last_refusal, HasSubstr("send TELEOP"));
}

/// A source at (1, 0), a mine at (0, 0), a console at (-2.5, 0) that is heard 2 m far, a battery of 200 J.
Scenario hazardous() {
  Scenario scenario;
  Hazard mine, source;
  mine.name = "mine";
  mine.nearness = 0.3;
  source.name = "source";
  source.kind = HazardKind::radiation;
  source.position = {1, 0, 0.5};
  source.strength = 100;
  scenario.hazards = {mine, source};
  scenario.radio.emplace();
  scenario.radio->position = {-2.5, 0, 0.5};
  scenario.radio->sensitivity = 20 - 40.05 - 20 * std::log10(2.0);
  scenario.battery.emplace();
  scenario.battery->capacity = 200;
  return scenario;
}

TEST_F(LevelsTest, OutOfRadioRangeTheOperatorIsNotHeardAndTheRobotStops) {
  Scenario scenario = hazardous();
  scenario.battery.reset();
  start(level_1({}, scenario));
  run(6, Twist2{0.4, 0, 0});
  const auto lost = events(EventKind::radio_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost[0].subject, "trainee");
  EXPECT_NEAR(lost[0].position.x(), -0.5, 0.05);
  EXPECT_EQ(events(EventKind::hazard_set_off).size(), 1U) << "it rolls on for its half second";
  EXPECT_EQ(decoded<TwistCommand>(channel::mr_cmd).back().twist.vx, 0);
  EXPECT_THAT(events(EventKind::command_reduced).back().text, HasSubstr("silen"));
  EXPECT_LT(motion().velocity.norm(), 0.01);
  EXPECT_NEAR(motion().T_map_base.translation().x(), -0.5 + 0.4 * 0.5, 0.15);
  EXPECT_EQ(state_->tally.refused_inputs, 0U) << state_->tally.last_refusal;
  Report report;
  report.tally = state_->tally;
  const ServerStatus status = to_status(report, {});
  const auto radio = std::find_if(status.values.begin(), status.values.end(),
                                  [](const auto& value) { return value.first == "radio_dbm"; });
  ASSERT_NE(radio, status.values.end());
  EXPECT_LT(radio->second, scenario.radio->sensitivity);
  EXPECT_FALSE(state_->tally.battery_left);
}

TEST_F(LevelsTest, ItsHazardSensorReadsAtTenHertzWhatIsThere) {
  start(level_1({}, hazardous()));
  run(2);
  const auto readings = decoded<HazardReading>(channel::hazard);
  EXPECT_NEAR(static_cast<double>(readings.size()), 20, 1);
  ASSERT_EQ(readings.back().values.size(), 1U);
  const double height = configuration_.robot.height;
  const Eigen::Vector3d sensor = motion().T_map_base * Eigen::Vector3d(0, 0, height);
  const double truth = 100 / (Eigen::Vector3d(1, 0, 0.5) - sensor).squaredNorm();
  const HazardSensor& its = configuration_.scenario.hazard_sensor;
  EXPECT_NEAR(readings.back().values[0].value, truth,
              4 * truth / std::sqrt(2 * its.radiation_counts * truth * its.radiation_lag));
  EXPECT_NE(readings.back().values[0].value, readings[readings.size() - 2].values[0].value) << "it counts";
  EXPECT_EQ(readings.back().values[0].unit, "uSv/h");
  EXPECT_NEAR((readings.back().stamp - readings.front().stamp).seconds(), 0.1 * (readings.size() - 1.0),
              1e-5);
}

TEST_F(LevelsTest, WithAnEmptyBatteryItStandsAndTheStatusSaysWhatIsLeft) {
  Scenario scenario = hazardous();
  scenario.radio.reset();
  scenario.battery->idle = 50;
  start(level_1({}, scenario));
  run(2);
  EXPECT_NEAR(state_->tally.battery_left.value_or(-1), 0.5, 0.06);
  run(6, Twist2{0.2, 0, 0});
  EXPECT_EQ(events(EventKind::battery_low).size(), 1U);
  EXPECT_EQ(events(EventKind::battery_empty).size(), 1U);
  EXPECT_LT(motion().velocity.norm(), 0.01);
  EXPECT_EQ(state_->tally.battery_left, 0);
}

Message operator_at(std::int64_t utime, const std::string& robot, OperatorWord::State state) {
  return test::message(channel::operators, utime,
                       OperatorWord{SensorTime::from_utime(utime), "ann", robot, state, "keys"});
}

TEST_F(LevelsTest, AnOperatorDrivesOneRobotAtATimeAndALostConsoleStopsIt) {
  start(level_1({test::agent("robot_1", AgentKind::robot, 2, 2, BehaviourKind::teleop)}));
  const auto says = [this](const std::string& robot, OperatorWord::State state) {
    feed(operator_at(teleop_at(time_, 0).arrival.utime(), robot, state));
    time_ += 0.05;
  };
  says("trainee", OperatorWord::State::drives);
  run(0.9, Twist2{0.4, 0, 0});
  EXPECT_GT(motion().velocity.x(), 0.3);
  says("robot_1", OperatorWord::State::drives);
  EXPECT_EQ(decoded<TwistCommand>(channel::mr_cmd).back().twist.vx, 0)
      << "the one that is left stops at once";
  says("nobody", OperatorWord::State::drives);
  EXPECT_THAT(state_->tally.last_refusal, HasSubstr("nobody"));
  const auto switched = events(EventKind::operator_switched);
  ASSERT_EQ(switched.size(), 2U);
  EXPECT_EQ(switched[1].subject, "ann");
  EXPECT_EQ(switched[1].object, "robot_1");
  run(3);
  const auto lost = events(EventKind::console_lost);
  ASSERT_EQ(lost.size(), 1U) << "nothing heard for a second";
  EXPECT_EQ(lost[0].object, "robot_1");
  says("trainee", OperatorWord::State::drives);
  run(3.5, Twist2{0.4, 0, 0});
  says("trainee", OperatorWord::State::lost);
  EXPECT_EQ(events(EventKind::console_lost).size(), 2U);
  EXPECT_EQ(decoded<TwistCommand>(channel::mr_cmd).back().twist.vx, 0);
}

TEST(Levels, AScenarioOfLevel1SaysItsRobotAndNothingOfARealOne) {
  const auto error_of = [](const std::string& yaml) {
    const auto scenario = parse_scenario("name: x\n" + yaml, "s.yaml");
    if (!scenario) return scenario.error().message;
    const Status checked = check_level(*scenario);
    return checked ? std::string() : checked.error().message;
  };
  EXPECT_EQ(error_of("level: 2\ntrainee: {model: rover}\n"), "");
  EXPECT_THAT(error_of("level: 1\n"), HasSubstr("scenario 'x': level 1 needs the trainee's robot"));
  EXPECT_THAT(error_of("level: 1\nrobot: r.yaml\ntrainee: {model: rover}\n"), HasSubstr("remove 'robot'"));
  EXPECT_THAT(error_of("level: 2\nmapping: true\ntrainee: {model: rover}\n"), HasSubstr("remove 'mapping'"));
  EXPECT_THAT(error_of("level: 1\npose: {position_sigma: 1 cm, yaw_sigma: 1 deg}\ntrainee: {model: rover}\n"),
              HasSubstr("remove 'pose'"));
  EXPECT_THAT(error_of("level: 3\ntrainee: {model: rover}\n"), HasSubstr("'trainee' is for levels 1 and 2"));
  Scenario scenario;
  scenario.level = 1;
  scenario.trainee.emplace();
  scenario.trainee->model = "rovre";
  auto rover = load_robot_model("rover");
  ASSERT_TRUE(rover);
  const auto refused = configure(scenario, {}, {}, {std::make_shared<const RobotModel>(std::move(*rover))});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("no robot model 'rovre' for the trainee; known: rover"));
}

/// A live session at level 1 over a memory bus, driven for some seconds.
class LevelsSession : public testing::Test {
 protected:
  Report serve_and_drive(const Configuration& configuration) {
    MemoryBusHub hub;
    const auto server = hub.connect(), console = hub.connect();
    EXPECT_TRUE(console->subscribe(channel::odometry, 10'000).ok());
    ServeOptions options;
    options.session = folder_ / "session.lcm";
    std::atomic<bool> stop = false;
    options.stop = [&stop] { return stop.load(); };
    std::optional<Result<Report>> report;
    std::thread thread([&] { report.emplace(serve(*server, configuration, options)); });
    Message heard;
    for (int i = 0; i < 150; ++i) {  // three seconds of its odometry
      const auto received = console->receive(heard, seconds(20));
      if (!received.ok() || !*received) break;
      if (i % 4 != 0) continue;
      const Message command = test::message(channel::teleop, 0, TwistCommand{{wall_now().ns}, {0.4, 0, 0.3}});
      EXPECT_TRUE(console->publish(command.channel, command.payload).ok());
    }
    stop = true;
    thread.join();
    EXPECT_TRUE(report->ok()) << report->error().message;
    return **report;
  }
  Result<Report> replay_session(std::optional<std::string> scenario = std::nullopt) {
    ReplayOptions again;
    again.log = folder_ / "session.lcm";
    again.session = folder_ / "again.lcm";
    again.overwrite = true;
    again.scenario = std::move(scenario);
    return replay(again);
  }

  test::Folder folder_;
};

TEST_F(LevelsSession, ASessionOfASimulatedRobotReplaysToTheSameBytes) {
  const Report live = serve_and_drive(
      level_1({test::agent("robot_1", AgentKind::robot, 2, 0, BehaviourKind::wander)}, hazardous()));
  EXPECT_GT(live.tally.scans_out, 50U);
  const auto replayed = replay_session();
  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->arrivals_corrected, 0U);
  EXPECT_EQ(replayed->hash, live.hash) << test::difference(folder_ / "session.lcm", folder_ / "again.lcm");
  for (const char* name :
       {channel::scan, channel::odometry, channel::imu, channel::pose_cov, channel::mr_scan, channel::mr_cmd,
        channel::mr_events, channel::hazard, channel::camera, channel::mr_camera})
    EXPECT_TRUE(replayed->hash.contains(name)) << name;
  EXPECT_EQ(replayed->hash.at(channel::mr_camera), replayed->hash.at(channel::camera))
      << "its bodies are in the picture: nothing is drawn twice";
  EXPECT_EQ(replayed->frames_dropped, live.frames_dropped) << "what live had no time for is not drawn now";
  EXPECT_EQ(live.tally.frames_out + live.frames_dropped, live.tally.frames_in);
  EXPECT_GT(live.tally.frames_out, 5U);
}

TEST_F(LevelsSession, WhatASimulatedRobotSaidReplaysAsARealRobotsRecording) {
  serve_and_drive(level_1());
  std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
  std::ofstream(folder_ / "level3.yaml")
      << "name: again\nlevel: 3\nmodel: model.yaml\n"
         "agents: [{name: barrel_1, kind: barrel, pose: {x: 3 m, y: 0 m}}]\n";
  const auto replayed = replay_session(folder_ / "level3.yaml");
  ASSERT_TRUE(replayed) << replayed.error().message;
  const Tally& tally = replayed->tally;
  EXPECT_GT(tally.scans_in, 50U);
  EXPECT_EQ(tally.scans_out, tally.scans_in);
  EXPECT_EQ(tally.refused_inputs, 0U) << tally.last_refusal;
  EXPECT_GT(tally.beams_replaced, 0U) << "the barrel is injected into them";
  EXPECT_GT(tally.frames_in, 5U) << "CAMERA is read back as a real camera's";
  EXPECT_EQ(tally.frames_out + replayed->frames_dropped, tally.frames_in)
      << "as live: a busy machine drops some";
  EXPECT_GT(tally.frames_composited, 0U) << "and the barrel is drawn into it";
  std::uint64_t degraded = 0;
  for (std::size_t why = 1; why < degraded_kinds; ++why) degraded += tally.scans_degraded[why];
  EXPECT_LE(degraded, 4U) << "but for the first ones";
}

}  // namespace
}  // namespace parhelion

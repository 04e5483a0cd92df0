// Levels 1 and 2: the simulated robot's sensors publish like a real robot's.
#include <gmock/gmock.h>

#include <set>

#include "tests/server/tick/levels_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::level_1;
using test::LevelsTest;
using test::teleop_at;
using testing::HasSubstr;

TEST_F(LevelsTest, SimulatedSensorsPublishAtTheirRatesAndAreReceived) {
  start(level_1());
  run(2);
  EXPECT_NEAR(static_cast<double>(out_[channel::kScan].size()), 2 * 40, 2) << "of a UTM-30LX";
  EXPECT_NEAR(static_cast<double>(out_[channel::kOdometry].size()), 2 * 50, 3);
  EXPECT_NEAR(static_cast<double>(out_[channel::kImu].size()), 2 * 100, 5);
  EXPECT_NEAR(static_cast<double>(out_[channel::kPoseCov].size()), 2 * 50, 3);
  EXPECT_EQ(out_[channel::kPose].size(), out_[channel::kPoseCov].size());
  EXPECT_GE(out_[channel::kBumper].size(), 19U);
  const auto robots = decoded<RobotMessage>(channel::kRobot);
  ASSERT_GE(robots.size(), 2U);
  const auto description = parse_robot_description(robots.front().yaml, "ROBOT");
  ASSERT_TRUE(description) << description.error().message;
  EXPECT_EQ(description->name, "trainee");
  // Nothing is injected into a simulated laser's scan.
  EXPECT_EQ(out_[channel::kMrScan], out_[channel::kScan]);
  EXPECT_EQ(out_[channel::kMrScanInfo].size(), out_[channel::kScan].size());
  EXPECT_TRUE(state_->robots.front().pose.at_this_step.has_value())
      << "the server gets the pose on its own channels";
  EXPECT_EQ(events(EventKind::localized).size(), 1U);
  EXPECT_EQ(state_->tally.refused_inputs, 0U) << state_->tally.last_refusal;
}

TEST_F(LevelsTest, TheCameraRequestsPicturesAtItsPoseAndRate) {
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
  for_each_body(last.job.world,
                [&](const BodyDefinition& body, const BodyState&) { shown.insert(body.entity); });
  EXPECT_TRUE(shown.contains("box_1") && shown.contains("trainee"));
  const Eigen::Vector3d eye = last.job.T_map_optical.translation();
  EXPECT_NEAR((eye - Eigen::Vector3d(-2.1, 0, 0.6)).norm(), 0, 0.02);
  const Eigen::Vector3d forwards = last.job.T_map_optical.rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(forwards.x(), 1, 1e-3);
}

TEST_F(LevelsTest, ScansShowTheBuildingWithLaserNoise) {
  start(level_1());
  run(1);
  const LaserDescription& laser = *configuration_.robot.laser;
  const auto T_map_laser = motion().T_map_base * laser.T_base_laser;
  const Scan scan = decoded<Scan>(channel::kScan).back();
  ASSERT_EQ(scan.ranges.size(), static_cast<std::size_t>(laser.beams));
  std::vector<float> time;
  scan::beam_times(laser, scan.ranges.size(), time);
  std::vector<scan::RangeHit> exact(time.size());
  scan::cast_building_exact({T_map_laser, T_map_laser}, {scan.angle_min, scan.angle_increment, time},
                            test::room(), 30, exact);
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

TEST_F(LevelsTest, TeleopDrivesTheSimulatedRobotUntilItsTimeout) {
  start(level_1());
  run(0.5);
  run(4.5, Twist2{0.4, 0, 0});
  const double reached = motion().T_map_base.translation().x();
  EXPECT_NEAR(reached, -2 + 0.4 * 4, 0.15);
  const Odometry odometry = decoded<Odometry>(channel::kOdometry).back();
  EXPECT_NEAR(odometry.T_odom_base.translation().x(), 0.4 * 4, 0.3) << "drifts as wheels do";
  EXPECT_NE(odometry.T_odom_base.translation().x(), reached + 2);
  EXPECT_EQ(decoded<TwistCommand>(channel::kMrCmd).back().twist.vx, 0.4F);
  run(6.5);
  EXPECT_LT(motion().velocity.norm(), 0.01);
  EXPECT_EQ(decoded<TwistCommand>(channel::kMrCmd).back().twist.vx, 0);
  EXPECT_LT(motion().T_map_base.translation().x(), reached + 0.4 * 0.5 + 0.2);
  EXPECT_EQ(events(EventKind::movement_started).size(), 1U);
  EXPECT_EQ(events(EventKind::movement_stopped).size(), 1U);
}

TEST_F(LevelsTest, AnExcessiveCommandIsLimitedToTheRobotsSpeed) {
  start(level_1());
  run(0.5);
  double fastest = 0;
  for (double end = 1; end <= 4; end += 0.5) {
    run(end, Twist2{100, 0, 0});
    fastest = std::max(fastest, motion().velocity.norm());
  }
  EXPECT_LE(fastest, 1.05 * configuration_.robot.limits.speed);
  EXPECT_GE(fastest, 0.9 * configuration_.robot.limits.speed);
  run(6, Twist2{std::numeric_limits<float>::quiet_NaN(), 0, 0});
  EXPECT_LT(motion().velocity.norm(), 0.01) << "what is no number is a stop";
  EXPECT_TRUE(motion().T_map_base.finite());
}

TEST_F(LevelsTest, ScansAndEventsNameAnObstacleAndBumperDetectsIt) {
  start(level_1({test::agent("box_1", AgentKind::box, 0, 0)}));
  run(0.5);
  const ScanInfo before = decoded<ScanInfo>(channel::kMrScanInfo).back();
  EXPECT_TRUE(before.live);
  ASSERT_EQ(before.agents, std::vector<std::string>{"box_1"});
  const std::size_t middle = before.beam_agent.size() / 2;
  EXPECT_EQ(before.beam_agent[middle], 0);
  const Scan scan = decoded<Scan>(channel::kScan).back();
  EXPECT_NEAR(scan.ranges[middle], 2 - 0.2 - configuration_.robot.laser->T_base_laser.translation().x(), 0.1);
  run(6, Twist2{0.5, 0, 0});
  const auto collisions = events(EventKind::contact_started);
  ASSERT_FALSE(collisions.empty());
  EXPECT_EQ(collisions.front().subject, "trainee");
  EXPECT_EQ(collisions.front().object, "box_1");
  bool bumped = false;
  for (const Joints& bumper : decoded<Joints>(channel::kBumper))
    bumped = bumped || bumper.positions.at(0) == 1;
  EXPECT_TRUE(bumped);
}

TEST_F(LevelsTest, AFallenRobotIsStillLocalized) {
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
  EXPECT_TRUE(events(EventKind::localization_lost).empty());
  EXPECT_TRUE(events(EventKind::relocalized).empty());
}

TEST_F(LevelsTest, AgentsKeepOffTheTraineesRobotWhichCanBeMoved) {
  start(level_1());
  run(0.2);
  const SensorTime stamp = SensorTime::from_utime(test::kStartUs);
  const auto at = [this] { return teleop_at(time_ += 0.05, 0).arrival.utime(); };
  feed(test::message(channel::kMrSpawn, at(),
                     AgentSpawn{stamp, 1, test::agent("box_1", AgentKind::box, -2, 0)}));
  EXPECT_EQ(events(EventKind::command_refused).size(), 1U);
  feed(test::message(channel::kMrMove, at(),
                     AgentMove{stamp, 2, "trainee", Transform<Map, Base>::planar(2, 1, 0)}));
  EXPECT_EQ(events(EventKind::command_accepted).size(), 1U);
  run(1);
  EXPECT_NEAR(motion().T_map_base.translation().x(), 2, 0.05);
  feed(test::message("MR_AGENT_trainee_TELEOP", at(),
                     TwistCommand{SensorTime::from_utime(test::kStartUs), {1, 0, 0}}));
  EXPECT_THAT(state_->tally.last_refusal, HasSubstr("send TELEOP"));
}

TEST(Levels, Level1RequiresATraineeAndRefusesRealRobotKeys) {
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
  auto rover = simulation::load_robot_model("rover");
  ASSERT_TRUE(rover);
  const auto refused =
      configure(scenario, {}, {}, {std::make_shared<const simulation::RobotModel>(std::move(*rover))});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("no robot model 'rovre' for the trainee; known: rover"));
}

}  // namespace
}  // namespace parhelion::tick

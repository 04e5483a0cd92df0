// The arm of a real robot on the bus: JOINT_STATE that is believed or not, and JOINT_CMD that is reduced.
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::test {
namespace {

constexpr const char* kAgentJoints = "MR_AGENT_robot_1_JOINT_CMD";

class RealArmTick : public TickTest {
 protected:
  void begin(std::vector<AgentDefinition> agents = {}) {
    const std::string folder = std::string(PARHELION_SOURCE_DIR) + "/examples/robot/";
    auto model = simulation::load_robot_model(folder + "body.yaml");
    auto description = load_robot_description(folder + "robot.yaml");
    ASSERT_TRUE(model.ok()) << model.error().message;
    ASSERT_TRUE(description.ok()) << description.error().message;
    description->model = model->name;
    Scenario scenario;
    scenario.name = "arm";
    scenario.agents = std::move(agents);
    auto made = tick::configure_robots(scenario, {*description}, room(),
                                       {std::make_shared<const simulation::RobotModel>(std::move(*model))});
    ASSERT_TRUE(made.ok()) << made.error().message;
    start(std::move(*made));
  }
  static std::int64_t us(double t) { return kStartUs + std::llround(1e6 * t); }
  Joints joints(double t) const {
    Joints all;
    all.stamp = SensorTime::from_utime(us(t));
    for (const auto& [name, position] : posture_) {
      all.names.push_back(name);
      all.positions.push_back(position);
    }
    return all;
  }
  void send_pose(double t) {
    feed(message(channel::kOdometry, us(t) + 2000, Odometry{SensorTime::from_utime(us(t)), {}}));
    PoseEstimate pose;
    pose.stamp = SensorTime::from_utime(us(t));
    pose.covariance = PoseCovariance::Identity() * 1e-5;
    pose.map_id = "synthetic";
    pose.state = SlamState::tracking;
    feed(message(channel::kPoseCov, us(t) + 3000, pose));
  }
  /// Pose and, unless `silent`, encoders at 20 Hz until t.
  void run(double until, bool silent = false) {
    for (; time_ < until - 1e-9; time_ += 0.05) {
      send_pose(time_);
      if (!silent) feed(message(channel::kJointState, us(time_) + 4000, joints(time_)));
    }
  }
  void command(const Joints& joints, const char* channel = channel::kJointCmd) {
    Joints stamped = joints;
    stamped.stamp = SensorTime::from_utime(us(time_));
    feed(message(channel, us(time_) + 5000, stamped));
  }
  std::vector<Event> events(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }
  Joints last_command() {
    const auto all = decoded<Joints>(channel::kMrJointCmd);
    return all.empty() ? Joints{} : all.back();
  }

  std::map<std::string, double> posture_{
      {"turret", 0}, {"shoulder", 0.3}, {"elbow", -1.0}, {"wrist", 0.7}, {"gripper", 0.02}};
  double time_ = 0;
};

TEST_F(RealArmTick, EncodersThatComeAreNoEvent) {
  begin();
  run(2);
  EXPECT_TRUE(events(EventKind::encoders_lost).empty());
  EXPECT_TRUE(state_->robots.front().encoders.fresh);
}

TEST_F(RealArmTick, WithoutJointStateTheReasonIsReportedOnce) {
  begin();
  run(2, true);
  const auto lost = events(EventKind::encoders_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost.front().subject, "example_robot");
  EXPECT_NE(lost.front().text.find("JOINT_STATE"), std::string::npos) << lost.front().text;
  run(3);
  EXPECT_EQ(events(EventKind::encoders_back).size(), 1U);
}

TEST_F(RealArmTick, AnotherReasonIsReportedInItsTurn) {
  begin();
  run(2, true);
  posture_.erase("wrist");
  run(6);
  const auto lost = events(EventKind::encoders_lost);
  ASSERT_EQ(lost.size(), 2U);
  EXPECT_EQ(lost[0].text.find("'wrist'"), std::string::npos) << lost[0].text;
  EXPECT_NE(lost[1].text.find("'wrist'"), std::string::npos) << lost[1].text;
  EXPECT_TRUE(events(EventKind::encoders_back).empty());
}

TEST_F(RealArmTick, SilentEncodersStopTheJointsWithTheReason) {
  begin();
  run(1);
  Joints forward;
  forward.names = {"shoulder"};
  forward.velocities = {-0.2};
  command(forward);
  EXPECT_EQ(last_command().velocities, forward.velocities);
  const double silent = time_;
  for (int i = 0; i < 16; ++i) {
    run(time_ + 0.05, true);
    command(forward);
  }
  const auto lost = events(EventKind::encoders_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_NE(lost.front().text.find("500 ms"), std::string::npos) << lost.front().text;
  EXPECT_NEAR((lost.front().stamp - SimulationTime::from_utime(us(silent))).seconds(), 0.46, 0.02);
  EXPECT_EQ(last_command().velocities, std::vector<double>{0}) << "a stop";
  const auto limited = events(EventKind::joint_limited);
  ASSERT_FALSE(limited.empty());
  EXPECT_EQ(limited.back().text, lost.front().text);
}

TEST_F(RealArmTick, APositionOutsideTheLimitsIsNotBelieved) {
  begin();
  run(1);
  posture_["elbow"] = 1.5;
  run(1.1);
  const auto lost = events(EventKind::encoders_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_EQ(lost.front().text, "joint 'elbow' is reported at 1.500 rad, outside its limits -2.500 to 0.200");
  posture_["elbow"] = -1;
  run(1.3);
  EXPECT_EQ(events(EventKind::encoders_back).size(), 1U) << "nothing is lost by it";
}

TEST_F(RealArmTick, AJumpIsBelievedOnlyWhenItLasts) {
  begin();
  run(1);
  posture_["turret"] = 2;
  run(1.2);
  const auto lost = events(EventKind::encoders_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_NE(lost.front().text.find("joint 'turret' jumps from 0.000 to 2.000 rad"), std::string::npos)
      << lost.front().text;
  EXPECT_TRUE(events(EventKind::encoders_back).empty());
  run(2);
  EXPECT_EQ(events(EventKind::encoders_back).size(), 1U);
}

// Fingers that touch a thing stop at once; carried on by their speed they would be in it, and let go again.
TEST_F(RealArmTick, FingersAreNeverWhereTheirEncodersHaveNotBeen) {
  begin();
  run(1);
  constexpr double open = 0.02, closed = 0.0101, per_message = 0.0025;
  for (int i = 0; i < 8; ++i) {
    posture_["gripper"] = std::max(closed, posture_["gripper"] - per_message);
    run(time_ + 0.05);
  }
  std::vector<double> gaps;
  for (const WorldMessage& world : decoded<WorldMessage>(channel::kMrWorld)) {
    std::map<std::string, Eigen::Vector3d> at;
    for (const WorldMessage::Entry& body : world.bodies) at[body.part] = body.T_map_body.translation();
    if (at.contains("left_finger")) gaps.push_back((at["left_finger"] - at["right_finger"]).norm());
  }
  ASSERT_GT(gaps.size(), 10U);
  EXPECT_NEAR(gaps.front() - gaps.back(), 2 * (open - closed), 1e-4);
  EXPECT_GT(*std::min_element(gaps.begin(), gaps.end()), gaps.back() - 1e-4)
      << "they closed farther than that";
}

TEST_F(RealArmTick, AMessageThatIsNotFiniteIsNotBelieved) {
  begin();
  run(1);
  posture_["wrist"] = std::numeric_limits<double>::quiet_NaN();
  run(1.1);
  const auto lost = events(EventKind::encoders_lost);
  ASSERT_EQ(lost.size(), 1U);
  EXPECT_NE(lost.front().text.find("JOINT_STATE"), std::string::npos) << lost.front().text;
  EXPECT_NE(lost.front().text.find("positions"), std::string::npos) << lost.front().text;
}

TEST_F(RealArmTick, AJointThatTheModelHasNotIsReportedOnceAndChangesNothing) {
  begin();
  posture_["tail"] = 1;
  run(2);
  EXPECT_TRUE(events(EventKind::encoders_lost).empty());
  EXPECT_EQ(state_->tally.refused_inputs, 1U);
}

TEST_F(RealArmTick, ACommandOfAJointThatTheModelHasNotIsNotPassed) {
  begin();
  run(1);
  Joints both;
  both.names = {"tail", "turret"};
  both.velocities = {1, 0.5};
  command(both);
  EXPECT_EQ(last_command().names, std::vector<std::string>{"turret"});
  EXPECT_EQ(last_command().velocities, std::vector<double>{0.5});
}

TEST_F(RealArmTick, ACommandIntoAVirtualThingIsReducedAndTheThingIsNamed) {
  AgentDefinition crate = agent("crate", AgentKind::box, 0.85, 0);
  crate.size = {0.1, 0.6, 1.2};
  begin({crate});
  run(1);
  Joints forward;
  forward.names = {"elbow"};
  forward.velocities = {0.9};  // stretches the arm
  command(forward);
  const auto limited = events(EventKind::joint_limited);
  ASSERT_EQ(limited.size(), 1U);
  EXPECT_EQ(limited.front().object, "elbow");
  EXPECT_EQ(limited.front().text, "crate");
  EXPECT_LT(last_command().velocities.front(), 0.9);
  EXPECT_GE(last_command().velocities.front(), 0);
  Joints back = forward;
  back.velocities = {-0.9};
  run(time_ + 0.05);
  command(back);
  EXPECT_EQ(last_command().velocities, back.velocities);
  EXPECT_EQ(events(EventKind::joint_limit_lifted).size(), 1U);
}

TEST_F(RealArmTick, TheSessionsHeaderHoldsTheArm) {
  begin();
  const auto header = tick::session_header(configuration_, SensorTime::from_utime(kStartUs));
  const auto again = tick::configuration_from(header, "log");
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->robot.model, "example_robot");
  EXPECT_EQ(again->robot.payload, 2);
  EXPECT_TRUE(tick::make_state(*again, ArrivalTime::from_utime(kStartUs)).ok());
}

TEST_F(RealArmTick, AVirtualRobotTakesJointCommandsFromTheBus) {
  AgentDefinition virtual_robot = agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::teleop);
  virtual_robot.model = "example_robot";
  begin({virtual_robot});
  const auto shoulder = [&] {
    const auto& motion = *state_->simulation.robot_motion("robot_1");
    const auto at = std::find(motion.joints.names.begin(), motion.joints.names.end(), "shoulder");
    return motion.joints.positions[static_cast<std::size_t>(at - motion.joints.names.begin())];
  };
  run(1);
  const double before = shoulder();
  Joints down;
  down.names = {"shoulder"};
  down.velocities = {-0.5};
  for (int i = 0; i < 20; ++i) {
    run(time_ + 0.05);
    command(down, kAgentJoints);
  }
  EXPECT_NEAR(shoulder(), before - 0.5, 0.08);
  Joints unknown = down;
  unknown.names = {"tail"};
  command(unknown, kAgentJoints);
  EXPECT_EQ(state_->tally.refused_inputs, 1U);
}

}  // namespace
}  // namespace parhelion::test

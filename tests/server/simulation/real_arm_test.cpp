// A real robot's arm among virtual things: what its encoders say moves it, and what it grips.
#include "real_arm_world.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using Names = std::vector<std::string>;

TEST_F(RealArmWorld, ItsLinksAreWhereTheEncodersAre) {
  start();
  move(hand_at(0.55, 0.5, 0.7, 0.06), 1);
  const BodyState left = body(*simulation_, "example_robot", "left_finger");
  const BodyState right = body(*simulation_, "example_robot", "right_finger");
  // The fingers' frames are 5 cm behind the middle of the pads, at their inner sides.
  const Eigen::Vector3d middle = (left.T_map_body.translation() + right.T_map_body.translation()) / 2;
  const double reach = 0.55 - 0.05;
  EXPECT_NEAR(middle.x(), reach * std::cos(0.7), 1e-9);
  EXPECT_NEAR(middle.y(), reach * std::sin(0.7), 1e-9);
  EXPECT_NEAR(middle.z(), 0.5, 1e-9);
  EXPECT_NEAR((left.T_map_body.translation() - right.T_map_body.translation()).norm(), 0.06, 1e-9);
}

TEST_F(RealArmWorld, ItsLinksMoveWithTheBaseAndAreNeverInjected) {
  start();
  wait(0.1);
  const Eigen::Vector3d before = body(*simulation_, "example_robot", "hand").T_map_body.translation();
  for (int i = 0; i < 240; ++i) step({}, {0.3, 0, 0});
  const Eigen::Vector3d after = body(*simulation_, "example_robot", "hand").T_map_body.translation();
  EXPECT_NEAR((after - before).x(), 0.3, 1e-6);
  for (const auto& definition : simulation_->scene()->bodies)
    if (definition->entity == "example_robot") {
      EXPECT_FALSE(definition->injectable);
      EXPECT_EQ(definition->owner, BodyOwner::real_robot);
    }
}

TEST_F(RealArmWorld, ItsContactsWithThingsAreEvents) {
  start();
  spawn(agent("crate", AgentKind::box, 0.75, 0), {0.2, 0.4, 0.6});
  move(hand_at(0.45, 0.5, 0, 0.02), 1);
  EXPECT_EQ(count(events_, EventKind::contact_started), 0U);
  move(hand_at(0.63, 0.5, 0, 0.02), 0.5);
  ASSERT_EQ(count(events_, EventKind::contact_started), 1U);
  const Event contact = only(events_, EventKind::contact_started).front();
  EXPECT_EQ(contact.subject, "example_robot");
  EXPECT_EQ(contact.object, "crate");
  EXPECT_EQ(contact.pair, PairKind::real_virtual);
  EXPECT_FALSE(contact.undetectable);
  EXPECT_TRUE(gripper_events().empty()) << "a closed gripper that pushes is not around it";
  wait(0.3);
  EXPECT_LT(body(*simulation_, "crate").T_map_body.rotation()(2, 2), 0.999) << "the real arm pushes it over";
}

TEST_F(RealArmWorld, FingersClosedAroundAThingGripItAtTheStep) {
  start();
  grip(0.06);
  ASSERT_EQ(gripper_events(), Names{"gripped post"});
  const Event gripped = only(events_, EventKind::gripped).front();
  EXPECT_EQ(gripped.subject, "example_robot");
  EXPECT_EQ(gripped.pair, PairKind::real_virtual);
  EXPECT_NEAR(gripped.value, 0.5 * 9.81, 1e-9) << "its weight";
  // The gap closes from 10 to 6 cm within 0.5 s, from 2 s on; 2 mm wider than the post it holds.
  EXPECT_NEAR(since_start(gripped), 2 + 0.5 * (0.100 - 0.062) / 0.04, 2 * kStep);
  EXPECT_EQ(simulation_->held_by(), "post");
}

TEST_F(RealArmWorld, AHeldThingMovesWithGripperAndBase) {
  start();
  grip();
  const Eigen::Vector3d before = place_of("post");
  move(hand_at(0.60, 0.68, 0, 0.06), 1.5);
  EXPECT_EQ(gripper_events(), (Names{"gripped post", "lifted post"}));
  EXPECT_NEAR(place_of("post").z() - before.z(), 0.30, 0.003);
  for (int i = 0; i < 240; ++i) step({}, {0.2, 0, 0.5});
  const BodyState left = body(*simulation_, "example_robot", "left_finger");
  const BodyState right = body(*simulation_, "example_robot", "right_finger");
  const Eigen::Vector3d middle = (left.T_map_body.translation() + right.T_map_body.translation()) / 2 +
                                 left.T_map_body.rotation() * Eigen::Vector3d(0.05, 0, 0);
  EXPECT_LT((place_of("post") - middle).head<2>().norm(), 0.004);
  EXPECT_EQ(gripper_events(), (Names{"gripped post", "lifted post"})) << "it is not dropped on the way";
}

TEST_F(RealArmWorld, AnOpenedGripperLetsItFall) {
  start();
  grip();
  move(hand_at(0.60, 0.68, 0, 0.06), 1.5);
  move(hand_at(0.60, 0.68, 0, 0.063), 0.1);
  EXPECT_EQ(simulation_->held_by(), "post") << "within the fingers' play";
  move(hand_at(0.60, 0.68, 0, 0.066), 0.1);
  EXPECT_EQ(simulation_->held_by(), "") << "wider than the thing";
  move(hand_at(0.60, 0.68, 0, 0.09), 0.5);
  wait(1);
  EXPECT_EQ(gripper_events(), (Names{"gripped post", "lifted post", "dropped post"}));
  EXPECT_LT(place_of("post").z(), 0.05);
}

TEST_F(RealArmWorld, IntoAContainerItIsPlaced) {
  start();
  spawn(agent("tub", AgentKind::container, 0, 0.56), {0.4, 0.4, 0.3});
  grip();
  move(hand_at(0.50, 0.76, 0, 0.06), 2);
  move(hand_at(0.50, 0.76, std::numbers::pi / 2, 0.06), 2);
  move(hand_at(0.56, 0.44, std::numbers::pi / 2, 0.06), 2);
  move(hand_at(0.56, 0.44, std::numbers::pi / 2, 0.1), 0.5);
  wait(3);
  EXPECT_EQ(gripper_events(), (Names{"gripped post", "lifted post", "placed tub"}));
}

TEST_F(RealArmWorld, NothingIsTakenByAGripperThatIsOpenerThanTheThing) {
  start();
  spawn(agent("post", AgentKind::box, 0.6, 0), {0.06, 0.06, 0.45});
  move(hand_at(0.44, 0.38, 0, 0.1), 1);
  move(hand_at(0.60, 0.38, 0, 0.1), 1);
  move(hand_at(0.60, 0.38, 0, 0.07), 0.5);
  move(hand_at(0.60, 0.68, 0, 0.07), 1);
  EXPECT_TRUE(gripper_events().empty());
  EXPECT_LT(place_of("post").z(), 0.005);
}

TEST_F(RealArmWorld, StaleEncodersFreezeTheGrip) {
  start();
  grip();
  move(hand_at(0.60, 0.68, 0, 0.06), 1);
  fresh_ = false;
  move(hand_at(0.60, 0.68, 0, 0.1), 0.5);
  EXPECT_EQ(simulation_->held_by(), "post") << "what such encoders say lets nothing fall";
  posture_ = hand_at(0.60, 0.68, 0, 0.06);
  fresh_ = true;
  wait(0.2);
  EXPECT_EQ(simulation_->held_by(), "post");
  EXPECT_EQ(gripper_events(), (Names{"gripped post", "lifted post"}));
}

TEST_F(RealArmWorld, ALostPoseKeepsTheThingUntilTheRobotAppearsElsewhere) {
  start();
  grip();
  move(hand_at(0.60, 0.68, 0, 0.06), 1);
  const Eigen::Vector3d before = place_of("post");
  there_ = false;
  wait(1);
  EXPECT_LT((place_of("post") - before).norm(), 0.002) << "it does not fall out of a hand that nobody sees";
  there_ = true;
  real_.T_map_base = Transform<Map, Base>::planar(-1, 0.5, 0);
  wait(0.2);
  EXPECT_NEAR(place_of("post").x(), before.x() - 1, 0.003);
  EXPECT_EQ(gripper_events(), (Names{"gripped post", "lifted post"}));
}

TEST_F(RealArmWorld, AThingOverThePayloadIsNotLiftedAndReported) {
  start();
  grip(0.06, 2.5);
  ASSERT_EQ(gripper_events(), (Names{"payload_exceeded post", "gripped post"}));
  EXPECT_NEAR(only(events_, EventKind::payload_exceeded).front().value, 1.25, 1e-9);
  move(hand_at(0.60, 0.68, 0, 0.06), 1);
  wait(0.5);
  EXPECT_LT(place_of("post").z(), 0.02);
  EXPECT_EQ(count(events_, EventKind::lifted), 0U);
}

TEST_F(RealArmWorld, AJointThatBearsTooMuchIsOverloadedOnce) {
  RobotDescription strong = robot_with_arm();
  strong.payload = 20;
  start(strong);
  grip(0.06, 8);
  move(hand_at(0.60, 0.68, 0, 0.06), 1);
  EXPECT_EQ(count(events_, EventKind::lifted), 1U);
  std::size_t shoulder = 0;
  for (const Event& event : events_) {
    if (event.kind != EventKind::joint_overload || event.object != "shoulder") continue;
    ++shoulder;
    EXPECT_GT(event.value, 1);
  }
  EXPECT_EQ(shoulder, 1U);
}

TEST_F(RealArmWorld, AJointCommandStopsAtAThingAndMayRetreat) {
  start();
  spawn(agent("crate", AgentKind::box, 0.75, 0), {0.2, 0.4, 0.6});
  const auto near = hand_at(0.45, 0.5, 0, 0), beyond = hand_at(0.69, 0.5, 0, 0);
  move(near, 1);
  Joints forward, back;
  for (const auto& [joint, position] : beyond) {
    const double travel = position - near.at(joint);
    if (std::abs(travel) < 1e-6) continue;
    forward.names.push_back(joint), back.names.push_back(joint);
    forward.velocities.push_back(travel), back.velocities.push_back(-travel);  // in a second
  }
  Joints asked = forward;
  EXPECT_TRUE(simulation_->limit_joints(asked, 0.1, 0.2).empty()) << "nothing is near";
  EXPECT_EQ(asked.velocities, forward.velocities);
  // Follows what is allowed: each joint by itself, so that the arm slides along the crate.
  double smallest = 1;
  for (int i = 0; i < 100; ++i) {
    asked = forward;
    simulation_->limit_joints(asked, 0.3, 0.7);
    const double fraction = asked.velocities.front() / forward.velocities.front();
    EXPECT_GE(fraction, 0);
    EXPECT_LE(fraction, 1);
    smallest = std::min(smallest, fraction);
    auto next = posture_;
    for (std::size_t k = 0; k < asked.names.size(); ++k) next[asked.names[k]] += 0.05 * asked.velocities[k];
    move(next, 0.05);
  }
  EXPECT_LT(smallest, 0.3);
  EXPECT_EQ(count(events_, EventKind::contact_started), 0U) << "it stops before it touches";
  const Joints retreat = back;
  EXPECT_TRUE(simulation_->limit_joints(back, 0.3, 0.7).empty());
  EXPECT_EQ(back.velocities, retreat.velocities);
}

TEST_F(RealArmWorld, APositionBeyondAThingBecomesOneBesideIt) {
  start();
  spawn(agent("crate", AgentKind::box, 0.75, 0), {0.2, 0.4, 1});
  move(hand_at(0.45, 0.6, 0, 0), 1);
  const auto wanted = hand_at(0.62, 0.6, 0, 0);
  Joints command;
  for (const auto& [joint, position] : wanted) {
    command.names.push_back(joint);
    command.positions.push_back(position);
  }
  for (int i = 0; i < 60; ++i) {
    Joints asked = command;
    simulation_->limit_joints(asked, 0.3, 0.7);
    auto next = posture_;
    for (std::size_t j = 0; j < asked.names.size(); ++j) {
      double& at = next[asked.names[j]];
      at += std::clamp(asked.positions[j] - at, -0.03, 0.03);
    }
    move(next, 0.05);
  }
  EXPECT_EQ(count(events_, EventKind::contact_started), 0U);
  EXPECT_LT(place_of("crate").x(), 0.7505) << "it was not pushed";
}

TEST_F(RealArmWorld, FingersCloseOnAThingUntilTheyHoldIt) {
  start();
  spawn(agent("post", AgentKind::box, 0.6, 0.01), {0.06, 0.06, 0.45});  // a centimetre beside the middle
  move(hand_at(0.44, 0.38, 0, 0.1), 1);
  move(hand_at(0.60, 0.38, 0, 0.1), 1);
  for (int i = 0; i < 80; ++i) {
    Joints close;
    close.names = {"gripper"};
    close.positions = {0};
    simulation_->limit_joints(close, 0.3, 0.7);
    auto next = posture_;
    next["gripper"] += std::clamp(close.positions.front() - next["gripper"], -0.003, 0.003);
    move(next, 0.05);
  }
  EXPECT_EQ(simulation_->held_by(), "post");
  EXPECT_GT(2 * posture_["gripper"], 0.055) << "it stops at the thing's width";
  EXPECT_LT(2 * posture_["gripper"], 0.0625);
  Joints open;
  open.names = {"gripper"};
  open.velocities = {0.05};
  EXPECT_TRUE(simulation_->limit_joints(open, 0.3, 0.7).empty());
}

TEST_F(RealArmWorld, AnOutstretchedArmLimitsTheDrive) {
  start();
  spawn(agent("crate", AgentKind::box, 1.2, 0), {0.2, 0.4, 1});
  move(hand_at(0.60, 0.6, 0, 0), 1);
  const auto clearance = simulation_->clearance(real_.T_map_base, {0.3, 0, 0}, 2);
  EXPECT_NEAR(clearance.distance, 1.1 - 0.22, 0.01) << "the footprint";
  EXPECT_NEAR(clearance.arm_distance, 1.1 - 0.65, 0.01) << "the fingers' ends";
  const auto away = simulation_->clearance(real_.T_map_base, {-0.3, 0, 0}, 2);
  EXPECT_NEAR(away.arm_distance, 2, 1e-9);
}

TEST_F(RealArmWorld, AHeldThingDoesNotLimitTheDrive) {
  start();
  grip();
  move(hand_at(0.42, 0.6, 0, 0.06), 1.5);
  const auto clearance = simulation_->clearance(real_.T_map_base, {0.3, 0, 0}, 2);
  EXPECT_NEAR(clearance.distance, 2, 1e-9);
  EXPECT_NEAR(clearance.arm_distance, 2, 1e-9);
}

TEST(RealArm, AModelThatIsNotInTheSessionIsAnError) {
  RobotDescription description = robot_with_arm();
  const auto made = Simulation::create({}, room(8), description, kStart);
  ASSERT_FALSE(made.ok());
  EXPECT_NE(made.error().message.find("no robot model 'example_robot'"), std::string::npos)
      << made.error().message;
}

}  // namespace
}  // namespace parhelion::simulation

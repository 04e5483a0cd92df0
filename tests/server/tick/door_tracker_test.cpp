// At level 3 the angles of real doors follow the scans; at other levels lasers and cameras see moved doors at
// their angle.
#include <gmock/gmock.h>

#include "protocols/door.hpp"
#include "tests/degree.hpp"
#include "tests/server/tick/level_1.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::kDegree;

/// The room, with a free-standing door 1 m wide at x = 2, closed across the x axis: hinged at y = -0.5, it
/// opens towards the origin.
SemanticModel room_with_door() {
  SemanticModel model = test::room();
  ModelEntity door;
  door.name = "door 1";
  door.label = EntityLabel::door;
  door.T_map_body = Transform<Map, Body>::planar(2, 0, std::numbers::pi / 2, 1);
  door.size = {1, 0.04, 2};
  door.hinge = Hinge{{-0.5, 0}, 0, std::numbers::pi / 2, 0};
  model.entities.push_back(door);
  return model;
}

class DoorTrackerTest : public test::TickTest {
 protected:
  /// The robot stands at the origin, heading along x; `opening`: of the real door, none: removed.
  void look(std::optional<double> opening, double duration) {
    const SemanticModel site = with_leaf(opening);
    for (const double end = time_ + duration; time_ < end - 1e-9; time_ += 0.1) {
      const std::int64_t utime = test::kStartUs + static_cast<std::int64_t>(time_ * 1e6);
      const SensorTime stamp = SensorTime::from_utime(utime);
      feed(test::message(channel::kOdometry, utime + 1000,
                         Odometry{stamp, Transform<Odom, Base>::planar(0, 0, 0)}));
      PoseEstimate pose;
      pose.stamp = stamp;
      pose.T_map_base = Transform<Map, Base>::planar(0, 0, 0);
      pose.covariance = PoseCovariance::Identity() * 1e-4;
      pose.covariance(5, 5) = 1e-6;
      pose.map_id = "synthetic";
      pose.state = SlamState::tracking;
      feed(test::message(channel::kPoseCov, utime + 2000, pose));
      feed(test::message(channel::kScan, utime + 8000, scan(stamp, site)));
    }
  }
  void start_at_level_3(const std::vector<AgentDefinition>& agents = {},
                        const RobotDescription& robot = test::robot()) {
    Scenario scenario;
    scenario.name = "doors";
    scenario.agents = agents;
    auto made = configure(scenario, robot, room_with_door());
    ASSERT_TRUE(made) << made.error().message;
    start(*made);
  }
  simulation::DoorState door() { return state_->simulation.doors().at(0); }
  std::size_t count_events(EventKind kind) {
    std::size_t count = 0;
    for (const Event& event : decoded<Event>(channel::kMrEvents)) count += event.kind == kind;
    return count;
  }

  double time_ = 0;

 private:
  static SemanticModel with_leaf(std::optional<double> opening) {
    SemanticModel model = room_with_door();
    ModelEntity leaf = model.entities.back();
    model.entities.pop_back();
    if (!opening) return model;
    leaf.T_map_body = leaf_at(leaf, *leaf.hinge, *opening);
    leaf.label = EntityLabel::wall;
    model.entities.push_back(leaf);
    return model;
  }
  static Scan scan(SensorTime stamp, const SemanticModel& site) {
    const LaserDescription laser = *test::robot().laser;
    Scan scan;
    scan.stamp = stamp;
    std::vector<float> time;
    scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
    std::vector<scan::RangeHit> none(time.size(),
                                     scan::RangeHit{std::numeric_limits<float>::infinity(), -1, 0});
    std::vector<scan::RangeHit> hits(time.size());
    const scan::BeamSet beams{static_cast<float>(laser.angle_min), static_cast<float>(laser.angle_increment),
                              time};
    scan::cast_building_exact({laser_at(), laser_at()}, beams, site, 30, hits);
    scan::simulate_scan(laser, {9, static_cast<std::uint64_t>(stamp.ns)}, none, hits, stamp, scan);
    return scan;
  }
  static Transform<Map, Laser> laser_at() {
    return Transform<Map, Base>::planar(0, 0, 0) * test::robot().laser->T_base_laser;
  }
};

TEST_F(DoorTrackerTest, ARealDoorFollowsTheScansAndIsUnknownUnseen) {
  start_at_level_3();
  EXPECT_FALSE(door().known);
  look(0.0, 0.5);
  EXPECT_TRUE(door().known);
  EXPECT_NEAR(door().opening, 0, 2 * kDegree);
  EXPECT_EQ(count_events(EventKind::door_opened), 0U);
  look(55 * kDegree, 1.5);
  EXPECT_NEAR(door().opening, 55 * kDegree, 2 * kDegree);
  EXPECT_EQ(count_events(EventKind::door_opened), 1U);
  look(0.0, 1.5);
  EXPECT_NEAR(door().opening, 0, 2 * kDegree);
  EXPECT_EQ(count_events(EventKind::door_closed), 1U);
  look(std::nullopt, 0.4);
  EXPECT_FALSE(door().known) << "beams pass where it was";
  look(55 * kDegree, 0.5);
  EXPECT_TRUE(door().known);
  EXPECT_EQ(count_events(EventKind::door_opened), 2U) << "it was closed when it was seen last";
}

TEST_F(DoorTrackerTest, TheSameScansGiveTheSameBytes) {
  std::map<std::string, std::vector<std::vector<std::uint8_t>>> first;
  for (int repeat = 0; repeat < 2; ++repeat) {
    time_ = 0;
    out_.clear();
    start_at_level_3();
    for (const double opening : {0.0, 0.5, 0.9, 0.3}) look(opening, 0.5);
    EXPECT_GE(out_[channel::kMrEvents].size(), 3U);
    if (repeat == 0) first = out_;
  }
  EXPECT_EQ(out_, first);
}

TEST_F(DoorTrackerTest, AVirtualRobotPassesADoorOnlyWhenOpen) {
  for (const double opening : {0.0, 85 * kDegree}) {
    AgentDefinition robot = test::agent("robot_1", AgentKind::robot, 3.5, 0.2, BehaviourKind::teleop);
    robot.T_map_base = Transform<Map, Base>::planar(3.5, 0.2, std::numbers::pi);
    time_ = 0;
    out_.clear();
    start_at_level_3({robot});
    look(opening, 0.5);
    for (int i = 0; i < 40; ++i) {
      state_->simulation.teleop("robot_1", {0.5, 0, 0});
      look(opening, 0.1);
    }
    const double x = state_->simulation.pose_of("robot_1")->translation().x();
    if (opening == 0) {
      EXPECT_GT(x, 2.1) << "it stands at the closed leaf";
      EXPECT_GE(count_events(EventKind::contact_started), 1U);
    } else {
      EXPECT_LT(x, 1.95) << "it is through";
    }
  }
}

/// The camera image is rendered with the leaf at its angle, and its scan returns are explained.
TEST_F(DoorTrackerTest, ScanAndCameraSeeTheDoorAtItsMeasuredAngle) {
  start_at_level_3({}, test::robot_with_camera());
  look(0.0, 0.5);
  look(40 * kDegree, 1.5);
  feed(test::image_at(test::kStartUs + static_cast<std::int64_t>((time_ - 0.1) * 1e6) + 4000));
  ASSERT_EQ(outputs_.frames().size(), 1U);
  const WorldSnapshot& world = outputs_.frames()[0].job.world;
  bool seen = false;
  for_each_body(world, [&](const BodyDefinition& definition, const BodyState& body) {
    if (definition.entity != "door 1") return;
    seen = true;
    const ModelEntity drawn = room_with_door().entities.back();
    const auto expected = leaf_at(drawn, *drawn.hinge, 40 * kDegree);
    EXPECT_LT((body.T_map_body.translation() - expected.translation()).norm(), 0.03);
  });
  EXPECT_TRUE(seen);
  // The leaf at its new angle explains the returns: it is not an obstacle.
  EXPECT_TRUE(state_->robots.front().scan.obstacles.empty());
}

/// The rover stands at x = -2, heading towards the door.
TEST_F(DoorTrackerTest, AtLevel1ScanAndCameraSeeTheDoorAngle) {
  for (const double opening : {0.0, 80 * kDegree}) {
    Scenario scenario;
    scenario.doors.emplace_back().name = "door 1";
    scenario.doors.back().angle = opening;
    out_.clear();
    start(test::level_1({}, scenario, room_with_door()));
    std::optional<WorldSnapshot> pictured;
    for (int step = 0; step < 120; ++step) {
      advance_to(ArrivalTime{state_->simulation.next_step().ns});
      if (!outputs_.frames().empty()) pictured = outputs_.frames().back().job.world;
    }
    const Scan scan = decoded<Scan>(channel::kScan).back();
    const double leaf = 4 - 0.02 - configuration_.robot.laser->T_base_laser.translation().x();
    const double ahead = scan.ranges[scan.ranges.size() / 2];
    if (opening == 0) {
      EXPECT_NEAR(ahead, leaf, 0.1);
    } else {
      EXPECT_GT(ahead, leaf + 0.5) << "through the opening";
    }
    ASSERT_TRUE(pictured.has_value());
    const BodyState* leaf_shown = nullptr;
    for_each_body(*pictured, [&](const BodyDefinition& definition, const BodyState& body) {
      if (definition.entity == "door 1") leaf_shown = &body;
    });
    ASSERT_NE(leaf_shown, nullptr);
    const ModelEntity drawn = room_with_door().entities.back();
    const auto expected = leaf_at(drawn, *drawn.hinge, opening);
    EXPECT_LT((leaf_shown->T_map_body.translation() - expected.translation()).norm(), 0.03);
  }
}

}  // namespace
}  // namespace parhelion::tick

// People in the depth images of a real robot become persons of the simulation.
#include "server/tick/depth_people.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/server/tick/tick_fixture.hpp"
#include "tests/server/tick/walker.hpp"

namespace parhelion::tick {
namespace {

using namespace test;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kHip = 0.85;  // m: legs below it, a trunk above

/// Looks to the left, to the middle of the robot's circle.
RobotDescription robot_with_depth() {
  RobotDescription description = robot();
  DepthCameraDescription& depth = description.depth.emplace();
  depth.intrinsics = {kWidth, kHeight, 140, 140, 79.5, 59.5};
  const Eigen::Quaterniond turned = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()) *
                                    Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  depth.T_base_optical = {turned, {0, 0.1, 0.7}};
  depth.range_max = 8;
  return description;
}

/// Walks to and fro in front of the camera.
Eigen::Vector2d walker_before(double t) { return {-0.6 + 0.9 * std::sin(0.5 * t), 0.5 * std::cos(0.5 * t)}; }

/// m along the optical axis to the walker's legs or trunk; 0: beside them.
double depth_of(const Eigen::Vector2d& place, double t, const Eigen::Vector3d& eye,
                const Eigen::Vector3d& direction) {
  const double angle = std::atan2(direction.y(), direction.x()), level = direction.head<2>().norm();
  const double swing = 0.25 * std::sin(2 * std::numbers::pi * 0.8 * t);
  double nearest = std::numeric_limits<double>::infinity();
  const auto add = [&](const Eigen::Vector2d& offset, double bottom, double top) {
    const double range = leg_range(eye.head<2>(), angle, place + offset);
    const double z = eye.z() + range * direction.z() / level;
    if (z >= bottom && z < top) nearest = std::min(nearest, range / level);
  };
  for (const double side : {-1.0, 1.0}) add({0.1 * side, swing * side}, 0, kHip);
  for (const double side : {-0.12, -0.06, 0.0, 0.06, 0.12}) add({side, 0}, kHip, 1.5);
  return std::isinf(nearest) ? 0 : nearest;
}

Message depth_at(const RobotDescription& robot, double t, bool with_walker) {
  const DepthCameraDescription& camera = *robot.depth;
  const Transform<Map, DepthOptical> T_map_depth = pose_at(t) * camera.T_base_optical;
  Image image;
  image.stamp = SensorTime::from_utime(kStartUs + std::llround(t * 1e6));
  image.width = kWidth, image.height = kHeight;
  image.format = PixelFormat::depth_mm;
  image.row_stride = 2 * kWidth;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Eigen::Vector3d direction =
          T_map_depth.rotation() * Eigen::Vector3d((x - 79.5) / 140, (y - 59.5) / 140, 1);
      const double depth =
          with_walker ? depth_of(walker_before(t), t, T_map_depth.translation(), direction) : 0;
      const auto mm = static_cast<std::uint16_t>(std::lround(1000 * depth));
      image.bytes.push_back(static_cast<std::uint8_t>(mm & 0xFF));
      image.bytes.push_back(static_cast<std::uint8_t>(mm >> 8));
    }
  }
  image.metadata.push_back({"encoding", {'r', 'a', 'w'}});
  return message(channel::kDepth, image.stamp.utime() + 8000, image);
}

std::vector<Message> drive_with_depth(double duration, bool with_walker) {
  const RobotDescription description = robot_with_depth();
  std::vector<Message> extra;
  for (int i = 1; i * 0.1 < duration; ++i) extra.push_back(depth_at(description, 0.1 * i, with_walker));
  std::vector<Message> log = drive(duration, std::move(extra));
  for (Message& each : log)
    if (each.channel == channel::kRobot)
      each = message(channel::kRobot, each.arrival.utime(),
                     RobotMessage{SensorTime::from_utime(kStartUs), to_yaml(description)});
  return log;
}

class DepthPeopleTest : public TickTest {
 protected:
  void begin() {
    Scenario scenario;
    scenario.name = "depth";
    auto made = configure(scenario, robot_with_depth(), room());
    ASSERT_TRUE(made.ok()) << made.error().message;
    start(*made);
  }
  /// Number of images after which somebody was within half a metre of the walker.
  int follow(const std::vector<Message>& log) {
    int followed = 0;
    for (const Message& each : log) {
      feed(each);
      if (each.channel != channel::kDepth) continue;
      const double t = static_cast<double>(each.arrival.utime() - kStartUs) * 1e-6;
      for (const simulation::RealPerson& person : state_->bystanders.persons)
        followed += (person.position - walker_before(t)).norm() < 0.5 ? 1 : 0;
    }
    return followed;
  }
};

TEST_F(DepthPeopleTest, AWalkerWhomNoLaserShowsIsOnePersonOfTheWorld) {
  begin();
  const auto log = drive_with_depth(10, true);
  EXPECT_GE(follow(log), 60);
  std::size_t bodies = 0, max_persons = 0;
  for (const WorldMessage& world : decoded<WorldMessage>(channel::kMrWorld)) {
    bodies += world.persons.size();
    max_persons = std::max(max_persons, world.persons.size());
  }
  EXPECT_GT(bodies, 100U);
  EXPECT_EQ(max_persons, 1U) << "legs and trunk are one person";
}

TEST_F(DepthPeopleTest, OdometryThatIsLateHidesNobody) {
  begin();
  std::vector<Message> log = drive_with_depth(10, true);
  for (Message& each : log)
    if (each.channel == channel::kOdometry) each.arrival = each.arrival + milliseconds(300);
  std::stable_sort(log.begin(), log.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  EXPECT_GE(follow(log), 60);
}

TEST_F(DepthPeopleTest, NobodyIsFoundWhereNobodyIs) {
  begin();
  EXPECT_EQ(follow(drive_with_depth(4, false)), 0);
  EXPECT_TRUE(state_->bystanders.persons.empty());
}

TEST_F(DepthPeopleTest, ScansAreTheSameWithAndWithoutPeopleInDepth) {
  begin();
  feed(drive_with_depth(6, true));
  const auto with = out_[channel::kMrScan];
  out_.clear();
  begin();
  feed(drive_with_depth(6, false));
  EXPECT_EQ(out_[channel::kMrScan], with);
}

TEST_F(DepthPeopleTest, APersonIsForgottenASecondAfterTheLastImage) {
  begin();
  const auto log = drive_with_depth(8, true);
  ArrivalTime last{};
  for (const Message& each : log) {
    feed(each);
    last = each.arrival;
    if (!state_->bystanders.persons.empty()) break;
  }
  ASSERT_FALSE(state_->bystanders.persons.empty());
  advance_to({last.ns + seconds(1.3).ns});
  EXPECT_TRUE(state_->bystanders.persons.empty());
}

TEST_F(DepthPeopleTest, ImagesThatCannotBeReadShowNobody) {
  begin();
  auto log = drive_with_depth(3, true);
  std::size_t n = 0;
  for (Message& each : log) {
    if (each.channel != channel::kDepth) continue;
    Image image;
    ASSERT_TRUE(decode(each.channel, each.payload, image).ok());
    switch (n++ % 4) {
      case 0:
        image.bytes.resize(image.bytes.size() / 2);
        break;
      case 1:
        image.width *= 2;
        break;
      case 2:
        image.metadata.front().value = {'p', 'n', 'g'};
        break;
      case 3:
        image.stamp = image.stamp + seconds(1000.0);
        break;
    }
    encode(image, each.payload);
  }
  feed(log);
  EXPECT_TRUE(state_->bystanders.persons.empty());
  EXPECT_GT(n, 20U);
}

}  // namespace
}  // namespace parhelion::tick

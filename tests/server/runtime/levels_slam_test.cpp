// Level 1 with `slam: true`: MRPT's SLAM estimates the pose from the simulated SCAN and ODOMETRY.
#include <gmock/gmock.h>

#include <deque>

#include "fusion/pose/slam.hpp"
#include "server/runtime/session_files.hpp"
#include "server/tick/sensor_path.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::runtime {
namespace {

constexpr Duration kSlamTakes = milliseconds(20);

class LevelsSlamTest : public test::TickTest {
 protected:
  void SetUp() override {
    auto files =
        load_session_files(std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/workshop.yaml", "");
    ASSERT_TRUE(files.ok()) << files.error().message;
    files->scenario.trainee->slam = true;
    files->scenario.trainee->model = "rover";
    files->scenario.agents.clear();
    auto made = tick::configure(files->scenario, *files->robot, files->model, files->robot_models);
    ASSERT_TRUE(made.ok()) << made.error().message;
    start(std::move(*made));
    now_ = ArrivalTime{state_->simulation.now().ns};
  }

  /// Passes the outputs to SLAM; its estimate arrives some time after the scan.
  void feed_slam() {
    for (const tick::Outputs::Entry& entry : outputs_.entries()) {
      out_[entry.channel].push_back(entry.payload);
      if (entry.channel == channel::kRobot && !slam_) {
        RobotMessage robot;
        ASSERT_TRUE(decode(entry.channel, entry.payload, robot).ok());
        const auto description = parse_robot_description(robot.yaml, "ROBOT");
        ASSERT_TRUE(description.ok()) << description.error().message;
        pose::SlamOptions options;
        const auto& T_map_base = configuration_.scenario.trainee->T_map_base;
        options.start = {T_map_base.translation().x(), T_map_base.translation().y(), 0};
        auto mapper = pose::make_mapper(*description, options);
        ASSERT_TRUE(mapper.ok()) << mapper.error().message;
        slam_ = std::move(*mapper);
      } else if (entry.channel == channel::kOdometry && slam_) {
        Odometry odometry;
        ASSERT_TRUE(decode(entry.channel, entry.payload, odometry).ok());
        slam_->add(odometry);
      } else if (entry.channel == channel::kScan && slam_) {
        Scan scan;
        ASSERT_TRUE(decode(entry.channel, entry.payload, scan).ok());
        if (auto estimate = slam_->add(scan))
          estimates_.push_back(test::message(channel::kPoseCov, (now_ + kSlamTakes).utime(), *estimate));
      }
    }
  }

  void live(double duration, const Twist2& twist) {
    for (const ArrivalTime end = now_ + seconds(duration); now_ < end;) {
      const ArrivalTime next = now_ + milliseconds(50);
      while (ArrivalTime{state_->simulation.next_step().ns} < next) {
        now_ = ArrivalTime{state_->simulation.next_step().ns};
        outputs_.clear();
        tick::advance(configuration_, now_, *state_, outputs_, observer_);
        feed_slam();
        while (!estimates_.empty() && estimates_.front().arrival <= now_) {
          outputs_.clear();
          tick::tick(configuration_, estimates_.front(), *state_, outputs_, observer_);
          estimates_.pop_front();
          feed_slam();
        }
      }
      now_ = next;
      outputs_.clear();
      tick::tick(configuration_,
                 test::message(channel::kTeleop, now_.utime(), TwistCommand{SensorTime{now_.ns}, twist}),
                 *state_, outputs_, observer_);
      feed_slam();
      compare();
    }
  }
  void compare() {
    const SensorTime at{state_->simulation.now().ns};
    const auto pose = tick::robot_pose(state_->robots.front().pose, at);
    if (!pose) return;
    const Eigen::Isometry3d off =
        state_->simulation.robot_motion("trainee")->T_map_base.isometry().inverse() *
        pose->T_map_base.isometry();
    worst_ = std::max(worst_, off.translation().head<2>().norm());
    worst_turn_ = std::max(worst_turn_, Eigen::AngleAxisd(off.linear()).angle());
    ++compared_;
  }

  ArrivalTime now_;
  std::unique_ptr<pose::Slam> slam_;
  std::deque<Message> estimates_;
  double worst_ = 0, worst_turn_ = 0;
  int compared_ = 0;
};

/// Fraction of the map's occupied cells within 0.1 m of the model.
double explained(const pose::GridMap& map, const SemanticModel& model) {
  int occupied = 0, near = 0;
  for (int row = 0; row < map.height; ++row) {
    for (int column = 0; column < map.width; ++column) {
      if (map.occupied[static_cast<std::size_t>(row * map.width + column)] < 0.65F) continue;
      ++occupied;
      const Eigen::Vector3d p(map.x_min + (column + 0.5) * map.resolution,
                              map.y_min + (row + 0.5) * map.resolution, 0.3);
      near += std::any_of(model.entities.begin(), model.entities.end(), [&](const ModelEntity& entity) {
        const Eigen::Array3d in_box = (entity.T_map_body.inverse() * p).array().abs();
        return entity.label != EntityLabel::floor && (in_box <= 0.5 * entity.size.array() + 0.1).all();
      });
    }
  }
  return occupied > 100 ? static_cast<double>(near) / occupied : 0;
}

TEST_F(LevelsSlamTest, TheRobotDrivesByTheSlamEstimateWhileMapping) {
  live(0.5, {});
  EXPECT_TRUE(state_->robots.front().pose.at_this_step.has_value()) << "SLAM has spoken";
  live(12, {0.4, 0, 0.5});
  live(12, {0.4, 0, -0.5});
  live(1, {});
  const Eigen::Vector3d odometry = decoded<Odometry>(channel::kOdometry).back().T_odom_base.translation();
  const Eigen::Vector3d truth =
      state_->simulation.robot_motion("trainee")->T_map_base.translation() - Eigen::Vector3d(4, 2.5, 0);
  EXPECT_GT((odometry - truth).head<2>().norm(), 0.05) << "wheels alone drift";
  EXPECT_GT(compared_, 450);
  EXPECT_LT(worst_, 0.10);
  EXPECT_LT(worst_turn_, 0.07);
  EXPECT_EQ(state_->tally.refused_inputs, 0U) << state_->tally.last_refusal;
  EXPECT_EQ(out_.count(channel::kPoseCov), 0U) << "only SLAM publishes it";
  EXPECT_THAT(tick::slam_note(state_->robots.front().sensors.get()), testing::HasSubstr("poses, off by"));
  const auto path = slam_->finish();
  EXPECT_GT(path.size(), 900U);
  EXPECT_GT(explained(slam_->grid_map(), configuration_.model), 0.95);
}

}  // namespace
}  // namespace parhelion::runtime

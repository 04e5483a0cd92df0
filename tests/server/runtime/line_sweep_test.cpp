// A 2D laser swept over the site, nodding or mounted on its side: its lines extend cloud and model like depth
// images.
#include "server/runtime/line_sweep.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "server/runtime/live_site.hpp"
#include "server/runtime/report.hpp"
#include "server/tick/tick.hpp"
#include "tests/model_box.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {
namespace {

/// rad, of the joint at t seconds.
using Tilt = std::function<double(double t)>;
double nodding(double t) { return 0.7 * std::sin(2 * std::numbers::pi * t / 4); }

SemanticModel furnished_room() {
  SemanticModel model = test::room();
  model.entities.push_back(test::model_box("floor 1", EntityLabel::floor, {0, 0, -0.05}, {10, 8, 0.1}));
  return model;
}

/// A laser 0.6 m over the floor, 40 lines a second of 9 ms; with a head it nods about the y axis.
LineLaserDescription line_laser(bool nods) {
  LineLaserDescription line;
  line.laser = *test::robot().laser;
  line.laser.beam_interval = 5e-5;
  line.laser.quantization = 0;
  line.laser.T_base_laser = Transform<Base, Laser>::planar(0.1, 0, 0, 0.6);
  if (nods) {
    line.head.push_back({"tilt", {0.1, 0, 0.6}, Eigen::Vector3d::UnitY()});
  } else {  // mounted on its side: the plane is perpendicular to the path, its middle upwards
    const Eigen::Quaterniond up(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitY()));
    line.laser.T_base_laser = {up, {0.1, 0, 0.6}};
  }
  return line;
}

tick::Configuration sweeping(const LineLaserDescription& line) {
  tick::Configuration configuration = test::configuration({});
  configuration.scenario.mapping = true;
  configuration.robot.line_laser = line;
  return configuration;
}

std::int64_t at(double t) { return test::kStartUs + static_cast<std::int64_t>(std::llround(t * 1e6)); }

Scan line_at(double t, const LineLaserDescription& line, const Tilt& tilt, const SemanticModel& site) {
  const LaserDescription& laser = line.laser;
  Scan scan;
  scan.stamp = SensorTime::from_utime(at(t));
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  std::vector<float> time;
  scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
  const auto place = [&](double when) {
    Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
    for (const HeadJoint& joint : line.head)
      turn = Eigen::Translation3d(joint.point) * Eigen::AngleAxisd(tilt(when), joint.axis) *
             Eigen::Translation3d(-joint.point);
    return test::pose_at(when) * Transform<Base, Base>(turn) * laser.T_base_laser;
  };
  std::vector<scan::RangeHit> hits(time.size());
  const scan::LaserMotion motion{place(t), place(t + laser.beam_interval * (laser.beams - 1))};
  scan::cast_building_exact(motion, {scan.angle_min, scan.angle_increment, time}, site, 30, hits);
  for (const scan::RangeHit& hit : hits)
    scan.ranges.push_back(std::isinf(hit.range) ? laser.convention.no_return_sentinel() : hit.range);
  return scan;
}

/// Messages in order of arrival, each with its driver's latency: encoder values arrive 60 ms after their
/// stamp.
std::vector<Message> drive_with_line(double duration, const LineLaserDescription& line, const Tilt& tilt) {
  std::vector<Message> log = test::drive(duration);
  const SemanticModel site = furnished_room();
  for (int i = 0; i * 0.025 < duration; ++i) {
    const double t = i * 0.025;
    log.push_back(test::message(channel::kLines, at(t) + 12'000, line_at(t, line, tilt, site)));
  }
  for (int i = 0; !line.head.empty() && i * 0.02 < duration; ++i) {
    const double t = i * 0.02;
    const Joints joints{SensorTime::from_utime(at(t)), {"tilt"}, {tilt(t)}, {}, {}};
    log.push_back(test::message(channel::kJointState, at(t) + 60'000, joints));
  }
  std::stable_sort(log.begin(), log.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  for (std::size_t i = 1; i < log.size(); ++i)
    log[i].arrival = std::max(log[i].arrival, log[i - 1].arrival + microseconds(1));
  return log;
}

struct Swept {
  std::vector<LineView> views;
  std::uint64_t left_out = 0, refused = 0;
};

Swept sweep(const tick::Configuration& configuration, const std::vector<Message>& log) {
  auto state = tick::make_state(configuration, log.front().arrival - milliseconds(1));
  EXPECT_TRUE(state.ok()) << state.error().message;
  LineSweep lines(*configuration.robot.line_laser, configuration.robot);
  Swept swept;
  tick::Outputs outputs;
  StageClock stages;
  for (const Message& message : log) {
    outputs.clear();
    tick::tick(configuration, message, **state, outputs, stages);
    const tick::RobotState& robot = (*state)->robots.front();
    if (message.channel != channel::kLines || !robot.scan.line) continue;
    lines.add(*robot.scan.line);
    while (auto view = lines.take(robot.pose)) swept.views.push_back(std::move(*view));
  }
  swept.left_out = lines.left_out();
  swept.refused = (*state)->tally.refused_inputs;
  return swept;
}

/// m, from the nearest surface of the room.
double off_the_room(const Eigen::Vector3f& p) {
  return std::min(
      {std::abs(std::abs(p.x()) - 4.95), std::abs(std::abs(p.y()) - 3.95), std::abs(1.0 * p.z())});
}

double worst_of(const cloud::PointCloud<Map>& cloud) {
  double worst = 0;
  for (const Eigen::Vector3f& p : cloud.points) worst = std::max(worst, off_the_room(p));
  return worst;
}

/// Adds one view after the other to a model without one of the room's walls; the wall must be found, and
/// nothing else that looks like a wall.
void expect_the_missing_wall(const std::vector<LineView>& views, const std::string& missing) {
  SemanticModel known = furnished_room();
  const auto wall = std::find_if(known.entities.begin(), known.entities.end(),
                                 [&](const ModelEntity& e) { return e.name == missing; });
  ASSERT_NE(wall, known.entities.end());
  const Eigen::Isometry3d T_wall_map = wall->T_map_body.isometry().inverse();
  const double thickness = wall->size.y();
  known.entities.erase(wall);
  LiveSite site(known);
  std::optional<SemanticModel> model;
  for (const LineView& view : views) {
    const auto made = site.add(view);
    ASSERT_TRUE(made.ok()) << made.error().message;
    if (*made) model = **made;
  }
  EXPECT_LT(worst_of(site.cloud()), 0.05);
  ASSERT_TRUE(model.has_value());
  std::vector<std::string> walls;
  for (const ModelEntity& entity : model->entities) {
    if (!entity.name.starts_with("live ") || entity.label != EntityLabel::wall) continue;
    walls.push_back(entity.name);
    const Eigen::Vector3d middle = T_wall_map * entity.T_map_body.translation();
    EXPECT_NEAR(std::abs(middle.y()), thickness / 2, 0.05) << entity.name << ": its face is what is seen";
    EXPECT_GT(entity.size.x(), 2) << entity.name;
  }
  EXPECT_EQ(walls.size(), 1U);
}

TEST(LineSweep, ANoddingLaserFindsAnUnmodelledWallAhead) {
  const auto line = line_laser(true);
  const Swept swept = sweep(sweeping(line), drive_with_line(8, line, nodding));
  EXPECT_EQ(swept.refused, 0U);
  ASSERT_GE(swept.views.size(), 3U) << "5.6 rad a second and a half: a view for each radian";
  EXPECT_LT(swept.left_out, 30U) << "of 320 lines, those before the first pose";
  expect_the_missing_wall(swept.views, "wall 2");
}

TEST(LineSweep, AVerticalLaserFindsTheWallByDriving) {
  const auto line = line_laser(false);
  const Swept swept = sweep(sweeping(line), drive_with_line(24, line, {}));
  EXPECT_EQ(swept.refused, 0U);
  ASSERT_GE(swept.views.size(), 3U) << "5.6 m are driven, 3.8 rad turned";
  expect_the_missing_wall(swept.views, "wall 4");
}

TEST(LineSweep, StaleEncoderValuesAreNotUsed) {
  const auto line = line_laser(true);
  auto log = drive_with_line(4, line, nodding);
  // The encoder stops after two seconds; elsewhere its last value is used for 0.2 s.
  std::erase_if(log, [](const Message& m) {
    return m.channel == channel::kJointState && m.arrival > ArrivalTime::from_utime(at(2.06));
  });
  const Swept swept = sweep(sweeping(line), log);
  EXPECT_GT(swept.left_out, 65U) << "lines of 1.75 s";
  for (const LineView& view : swept.views) EXPECT_LT(stamp_of(view), SensorTime::from_utime(at(2.01)));
}

TEST(LineSweep, AStandingLaserGivesNoView) {
  const auto line = line_laser(true);
  auto log = drive_with_line(6, line, [](double) { return 0.3; });
  std::erase_if(log, [](const Message& m) {
    return m.channel == channel::kOdometry || m.channel == channel::kPoseCov || m.channel == channel::kScan;
  });
  for (int i = 0; i < 60; ++i) {
    PoseEstimate still;
    still.stamp = SensorTime::from_utime(at(0.1 * i));
    still.T_map_base = test::pose_at(0);
    still.covariance = PoseCovariance::Identity() * 1e-4;
    still.map_id = "synthetic";
    still.state = SlamState::tracking;
    log.push_back(test::message(channel::kPoseCov, at(0.1 * i) + 20'100, still));
  }
  std::stable_sort(log.begin(), log.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  EXPECT_TRUE(sweep(sweeping(line), log).views.empty());
}

TEST(LineSweep, ScanLinesOfAnUndescribedLaserAreRefused) {
  const auto line = line_laser(true);
  tick::Configuration configuration = sweeping(line);
  const auto log = drive_with_line(0.3, line, nodding);
  configuration.robot.line_laser.reset();
  auto state = tick::make_state(configuration, log.front().arrival - milliseconds(1));
  ASSERT_TRUE(state.ok());
  tick::Outputs outputs;
  StageClock stages;
  for (const Message& message : log) tick::tick(configuration, message, **state, outputs, stages);
  EXPECT_GT((*state)->tally.refused_inputs, 0U);
  EXPECT_NE((*state)->tally.last_refusal.find("line_laser"), std::string::npos)
      << (*state)->tally.last_refusal;
}

}  // namespace
}  // namespace parhelion::runtime

// Real doors of a real building, passed by a robot with a laser: their angles, fitted to single scans, must
// agree with those from all other scans together.
#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <sstream>

#include "fusion/scan/leaf_fit.hpp"
#include "tests/degree.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::kDegree;

struct PlacedScan {
  Eigen::Vector3d pose;  ///< m, m, rad: of the laser in the map, from SLAM over the whole recording
  std::vector<float> ranges;
};

/// FLASER lines of a CARMEN log, compressed.
std::vector<PlacedScan> read_placed_scans(const std::filesystem::path& path) {
  std::vector<PlacedScan> scans;
  gzFile file = gzopen(path.c_str(), "rb");
  std::vector<char> line(65536);
  while (file && gzgets(file, line.data(), static_cast<int>(line.size()))) {
    std::istringstream in(line.data());
    std::string word;
    std::size_t beams = 0;
    if (!(in >> word >> beams) || word != "FLASER") continue;
    PlacedScan scan;
    scan.ranges.resize(beams);
    for (float& range : scan.ranges) in >> range;
    if (in >> scan.pose.x() >> scan.pose.y() >> scan.pose.z()) scans.push_back(std::move(scan));
  }
  if (file) gzclose(file);
  return scans;
}

LaserDescription sick() {
  LaserDescription laser;
  laser.convention = {0.1F, 80, RangeConvention::Sentinel::value, 81.83F, RangeConvention::Sentinel::value,
                      0};
  laser.noise_sigma = 0.01;
  laser.beams = 180;
  laser.angle_min = -90 * kDegree;
  laser.angle_increment = kDegree;
  return laser;
}

/// A door as modelled from a floor plan: its hinge, its closed angle, and its swing direction. Its opening is
/// unknown.
struct Plan {
  const char* name;
  double x, y;    ///< m, the hinge's axis in the map
  double closed;  ///< rad, direction from the hinge along the wall to the other jamb
  int swings;     ///< 1: counter-clockwise
};
constexpr std::array<Plan, 4> kPlans{{{"meeting room, west", -2.378, -19.743, 3 * kDegree, -1},
                                      {"meeting room, east", 4.187, -19.518, 183 * kDegree, 1},
                                      {"upper office", -6.782, -9.216, -88 * kDegree, -1},
                                      {"lower office", -6.530, -15.831, 92 * kDegree, 1}}};
/// The partition wall that the doors open towards, from the same plan: from this point along it.
struct Partition {
  double x, y, yaw, length;  ///< m, m, rad, m
};
constexpr std::array<Partition, 4> kPartitions{{{-2.54, -20.17, -87 * kDegree, 2.7},
                                                {4.60, -19.60, -89 * kDegree, 3.1},
                                                {-6.79, -8.96, -177 * kDegree, 3},
                                                {-6.55, -16.14, -178 * kDegree, 3}}};
constexpr double kLeaf = 0.9;             // m
constexpr double kSwing = 130 * kDegree;  // maximum opening
constexpr double kPoseSigma = 0.03;       // m: spread of one wall in scans of several visits

ModelEntity door_of(const Plan& plan) {
  ModelEntity door;
  door.name = plan.name;
  door.label = EntityLabel::door;
  door.size = {kLeaf, 0.05, 2};
  const Eigen::Vector2d middle = Eigen::Vector2d(plan.x, plan.y) +
                                 kLeaf / 2 * Eigen::Vector2d(std::cos(plan.closed), std::sin(plan.closed));
  door.T_map_body = Transform<Map, Body>::planar(middle.x(), middle.y(), plan.closed, 1);
  door.hinge = Hinge{{-kLeaf / 2, 0}, plan.swings > 0 ? 0 : -kSwing, plan.swings > 0 ? kSwing : 0, 0};
  return door;
}

/// The plan with its doors and the walls beside them.
SemanticModel site() {
  SemanticModel model;
  model.map_id = "synthetic";
  for (const Plan& plan : kPlans) model.entities.push_back(door_of(plan));
  for (const Partition& wall : kPartitions) {
    ModelEntity entity;
    entity.name = "wall " + std::to_string(model.entities.size());
    entity.label = EntityLabel::wall;
    entity.size = {wall.length, 0.1, 2.5};
    const Eigen::Vector2d along(std::cos(wall.yaw), std::sin(wall.yaw));
    const Eigen::Vector2d middle = Eigen::Vector2d(wall.x, wall.y) + wall.length / 2 * along;
    entity.T_map_body = Transform<Map, Body>::planar(middle.x(), middle.y(), wall.yaw, 1.25);
    model.entities.push_back(entity);
  }
  return model;
}

/// A door's angle from all scans of even number together, rad: the angle about its hinge with most returns
/// that are not from walls. Independent of leaf models, free beams and single scans.
double densest_angle(const std::vector<PlacedScan>& scans, const Plan& plan, const SemanticModel& model) {
  std::vector<double> angles;
  for (std::size_t i = 0; i < scans.size(); i += 2) {
    for (std::size_t k = 0; k < scans[i].ranges.size(); ++k) {
      const double range = static_cast<double>(scans[i].ranges[k]);
      const double beam = scans[i].pose.z() - 90 * kDegree + static_cast<double>(k) * kDegree;
      const Eigen::Vector2d p =
          scans[i].pose.head<2>() + range * Eigen::Vector2d(std::cos(beam), std::sin(beam));
      const Eigen::Vector2d arm = p - Eigen::Vector2d(plan.x, plan.y);
      if (arm.norm() < 0.4 || arm.norm() > kLeaf) continue;
      const bool of_wall =
          std::any_of(model.entities.begin(), model.entities.end(), [&](const ModelEntity& entity) {
            const Eigen::Vector3d q = entity.T_map_body.inverse() * Eigen::Vector3d(p.x(), p.y(), 1);
            return entity.label == EntityLabel::wall &&
                   ((q.cwiseAbs() - entity.size / 2).array() < 0.1).all();
          });
      const double turned =
          std::remainder(std::atan2(arm.y(), arm.x()) - plan.closed, 2 * std::numbers::pi) * plan.swings;
      if (!of_wall && turned >= 0 && turned <= kSwing) angles.push_back(turned);
    }
  }
  std::sort(angles.begin(), angles.end());
  std::size_t begin = 0, max_count = 0;
  double middle = -1;
  for (std::size_t end = 0; end < angles.size(); ++end) {
    while (angles[end] - angles[begin] > 5 * kDegree) ++begin;
    if (end - begin > max_count) max_count = end - begin, middle = angles[(begin + end) / 2];
  }
  return middle;
}

class RealDoors : public test::TickTest {
 protected:
  void SetUp() override {
    const auto path = test::recording("slam2d-intel/intel-corrected.gfs.log.gz");
    PARHELION_NEEDS_RECORDING(path);
    scans_ = read_placed_scans(path);
    ASSERT_EQ(scans_.size(), 910U);
    for (std::size_t i = 0; i < kPlans.size(); ++i) shown_[i] = densest_angle(scans_, kPlans[i], model_);
  }
  Scan scan(std::size_t i, SensorTime stamp = {}) const {
    Scan scan;
    scan.stamp = stamp;
    scan.ranges = scans_[i].ranges;
    scan.angle_min = static_cast<float>(-90 * kDegree);
    scan.angle_increment = static_cast<float>(kDegree);
    return scan;
  }

  const SemanticModel model_ = site();
  std::vector<PlacedScan> scans_;
  std::array<double, kPlans.size()> shown_{};  ///< rad, from the scans of even number
};

TEST_F(RealDoors, SingleScansMeasureTheDoorAngleOfTheOthers) {
  const LaserDescription laser = sick();
  scan::LeafFit fit;
  const std::vector<float> time(180, 0.F);
  for (std::size_t d = 0; d < kPlans.size(); ++d) {
    const Plan& plan = kPlans[d];
    const ModelEntity door = door_of(plan);
    const double shown = shown_[d];
    const auto walls = scan::walls_beside(door, *door.hinge, model_);
    int reported = 0, wrong = 0;
    double worst = 0;
    for (std::size_t i = 1; i < scans_.size(); i += 2) {
      const Scan real = scan(i);
      const auto T_map_laser =
          Transform<Map, Laser>::planar(scans_[i].pose.x(), scans_[i].pose.y(), scans_[i].pose.z(), 1);
      fit.set_scan(real, laser, {T_map_laser, T_map_laser}, time, kPoseSigma);
      const scan::LeafFitResult sight = fit.find(door, *door.hinge, {}, walls);
      if (!sight.angle) continue;
      const double off = std::abs(opening_of(*door.hinge, *sight.angle) - shown);
      ++reported;
      worst = std::max(worst, off);
      wrong += off > 8 * kDegree;
    }
    EXPECT_GE(reported, 3) << plan.name;
    EXPECT_EQ(wrong, 0) << plan.name << ", worst " << worst / kDegree << " degrees off " << shown / kDegree;
  }
}

TEST_F(RealDoors, AtLevel3DoorsFollowTheRecording) {
  RobotDescription robot = test::robot();
  robot.laser = sick();
  robot.laser->T_base_laser = Transform<Base, Laser>::planar(0, 0, 0, 1);
  Scenario scenario;
  scenario.name = "doors";
  auto made = configure(scenario, robot, model_);
  ASSERT_TRUE(made) << made.error().message;
  start(*made);
  std::map<std::string, double> opening;
  for (std::size_t i = 0; i < scans_.size(); ++i) {
    const std::int64_t utime = test::kStartUs + static_cast<std::int64_t>(i) * 200'000;
    const SensorTime stamp = SensorTime::from_utime(utime);
    const auto& at = scans_[i].pose;
    feed(test::message(channel::kOdometry, utime + 1000,
                       Odometry{stamp, Transform<Odom, Base>::planar(at.x(), at.y(), at.z())}));
    PoseEstimate pose;
    pose.stamp = stamp;
    pose.T_map_base = Transform<Map, Base>::planar(at.x(), at.y(), at.z());
    pose.covariance = PoseCovariance::Identity() * kPoseSigma * kPoseSigma;
    pose.covariance(5, 5) = 1e-4;
    pose.map_id = "synthetic";
    pose.state = SlamState::tracking;
    feed(test::message(channel::kPoseCov, utime + 2000, pose));
    feed(test::message(channel::kScan, utime + 8000, scan(i, stamp)));
    for (const simulation::DoorState& door : state_->simulation.doors()) {
      if (!door.known) continue;
      opening[door.name] = door.opening;
      const auto plan =
          std::find_if(kPlans.begin(), kPlans.end(), [&](const Plan& p) { return p.name == door.name; });
      EXPECT_NEAR(door.opening, shown_[static_cast<std::size_t>(plan - kPlans.begin())], 10 * kDegree)
          << door.name << ", scan " << i;
    }
  }
  for (const Plan& plan : kPlans) EXPECT_TRUE(opening.contains(plan.name)) << plan.name;
}

}  // namespace
}  // namespace parhelion::tick

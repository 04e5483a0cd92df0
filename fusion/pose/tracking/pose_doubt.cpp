#include "fusion/pose/tracking/pose_doubt.hpp"

#include <cmath>

namespace parhelion::pose {
namespace {

/// Chosen on the generated buildings of localization_test.cpp, and so that the recordings of
/// docs/measurements/localization.md give no false alarm.
constexpr double kMuchChange = 0.4, kAllChanged = 0.7;
/// Of what the map usually explains: people who leave change much, and the map explains more.
constexpr double kAsUsual = 0.8;
/// s: in a longer time people who pass change much. Chosen on fr-clinic, where scans are 0.7 s apart.
constexpr double kSoon = 0.5;
constexpr double kMemory = 1;  ///< s
constexpr double kMuchMotion = 0.25,
                 kMuchTurn = 0.25;            ///< m, rad; and the same fraction of odometry's motion
constexpr double kJust = 0.3, kStill = 0.05;  ///< s; m and rad, of odometry in that time
constexpr Duration kDoubted = seconds(1.0);

}  // namespace

void PoseDoubt::forget() {
  previous_.forget();
  moved_otherwise_.reset();
  displaced_ = still_ = false;
  unexplained_.setZero();
  unexplained_yaw_ = driven_ = turned_ = just_driven_ = 0;
}

void PoseDoubt::add(const ScanPoints& scan, const Pose2& T_map_before, const Pose2& T_map_now,
                    const ScanOdometry::Step& odometry, double of_usual) {
  const Pose2 step = T_map_before.inverse() * T_map_now, expected = T_map_before * odometry.step;
  const double dt = previous_.seconds_until(scan.stamp);
  const double enough = of_usual < kAsUsual && dt < kSoon ? kMuchChange : kAllChanged;
  const ScanPoints* before = previous_.comparable(scan.stamp);
  displaced_ = before != nullptr && change_between(*before, scan, step).exceeds(enough) &&
               change_between(*before, scan, odometry.step).exceeds(enough);
  const double kept = std::exp(-std::max(dt, 0.0) / kMemory);
  unexplained_ = kept * unexplained_ + (T_map_now.position() - expected.position());
  unexplained_yaw_ = kept * unexplained_yaw_ + wrap_angle(T_map_now.yaw - expected.yaw);
  driven_ = kept * driven_ + odometry.step.position().norm();
  turned_ = kept * turned_ + std::abs(odometry.step.yaw);
  just_driven_ = std::exp(-std::max(dt, 0.0) / kJust) * just_driven_ + odometry.step.position().norm() +
                 std::abs(odometry.step.yaw);
  still_ = !odometry.known || just_driven_ < kStill;
  if (unexplained_.norm() > kMuchMotion * (1 + driven_) ||
      std::abs(unexplained_yaw_) > kMuchTurn * (1 + turned_))
    moved_otherwise_ = scan.stamp;
  now_ = scan.stamp;
  previous_.set(scan);
}

bool PoseDoubt::carried() const { return moved_otherwise() && still_; }

bool PoseDoubt::moved_otherwise() const { return moved_otherwise_ && now_ - *moved_otherwise_ <= kDoubted; }

}  // namespace parhelion::pose

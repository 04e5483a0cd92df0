// Drives in a building that start anywhere, and robots that are carried to another place on the way while
// their wheels stand still.
#pragma once

#include <optional>

#include "tests/fusion/pose/repeating_building.hpp"

namespace parhelion::test {

/// From anywhere, through doors that are open, for at least `length` m where there is room enough.
inline std::vector<Eigen::Vector2d> wandering(const RepeatingBuilding& building, double length,
                                              std::mt19937& random) {
  const std::vector<Segment>& walls = building.walls.now;
  const std::size_t corridor = building.rooms.size() - 1;
  std::size_t at = random() % 10 < 7 ? random() % corridor : corridor;
  std::vector<Eigen::Vector2d> route{building::free_place(walls, building.rooms[at], random)};
  double driven = 0;
  for (int tries = 0; tries < 40 && (driven < length || route.size() < 2); ++tries) {
    const std::size_t before = route.size();
    const Room& room = building.rooms[at];
    const bool through = at != corridor && room.open && building::is_free(walls, route.back(), room.inside) &&
                         building::is_free(walls, room.inside, room.outside);
    if (through && tries > 0) {
      route.push_back(room.inside);
      route.push_back(room.outside);
      at = corridor;
    } else {
      building::roam(route, walls, room, 1, random);
    }
    for (std::size_t i = before; i < route.size(); ++i) driven += (route[i] - route[i - 1]).norm();
  }
  if (route.size() < 2) route.push_back(route.back() + Eigen::Vector2d(0.2, 0));
  return route;
}

/// From one path to another: carried in a straight line, turning, which takes `seconds` and may be at once.
class KidnappedPath {
 public:
  KidnappedPath(TruePath before, TruePath after, double since, double seconds)
      : before_(std::move(before)), after_(std::move(after)), since_(since), seconds_(seconds) {}

  Pose2 at(double t) const {
    if (t < since_) return before_.at(t);
    if (t >= since_ + seconds_) return after_.at(t - since_ - seconds_);
    return interpolate(before_.at(since_), after_.at(0), (t - since_) / seconds_);
  }
  bool is_carried(double t) const { return t >= since_ && t < since_ + seconds_; }
  /// What the wheels do at t.
  const TruePath& wheels(double& t) const {
    if (t < since_) return before_;
    t = std::max(0.0, t - since_ - seconds_);
    return after_;
  }

 private:
  TruePath before_, after_;
  double since_, seconds_;
};

struct KidnappedOptions {
  TrueDriveOptions drive;
  double seconds = 10;          ///< of the whole drive
  std::optional<double> since;  ///< s, when it is picked up
  double carried = 0;           ///< s, 0: at once
  bool silent = false;          ///< odometry sends nothing meanwhile
};

struct KidnappedDrive {
  RobotDescription robot;
  std::vector<TrueScan> scans;
  std::vector<Odometry> odometry;
  double unmapped = 0;  ///< fraction of the beams that end on something which is not in the map
};

namespace kidnapped {

inline std::vector<Odometry> odometry(const KidnappedPath& path, const KidnappedOptions& options,
                                      std::mt19937& random) {
  std::vector<Odometry> result;
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> jitter(-options.drive.odometry_jitter,
                                                options.drive.odometry_jitter);
  Pose2 odom;
  const double sigma = options.drive.odometry_noise, period = options.drive.odometry_period;
  for (double t = 0; t < options.seconds; t += period) {
    double before = t - period, now = t;
    const TruePath& wheels = path.wheels(now);
    if (&path.wheels(before) == &wheels && t > 0) {
      Twist2 step = twist_to(wheels.at(before).inverse() * wheels.at(now));
      step.vx = options.drive.odometry_scale * step.vx + sigma * std::sqrt(std::abs(step.vx)) * noise(random);
      step.wz = options.drive.odometry_scale * step.wz + sigma * std::sqrt(std::abs(step.wz)) * noise(random);
      odom = odom * moved(step, 1);
    }
    if (options.silent && path.is_carried(t)) continue;
    result.push_back(
        {SensorTime{TrueDrive::kStart} + parhelion::seconds(t + options.drive.odometry_late + jitter(random)),
         transform<Odom, Base>(odom)});
  }
  return result;
}

/// Counts in `unmapped` the beams that the map would have explained otherwise.
inline Scan scan_at(const TrueBuilding& building, const std::vector<Walker>& walkers,
                    const RobotDescription& robot, const KidnappedPath& path, double t, double sigma,
                    std::mt19937& random, double& unmapped) {
  const LaserDescription& laser = *robot.laser;
  Scan scan;
  scan.stamp = SensorTime{TrueDrive::kStart} + parhelion::seconds(t);
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  std::normal_distribution<double> noise;
  const auto beams = static_cast<std::size_t>(laser.beams);
  for (std::size_t i = 0; i < beams; ++i) {
    const double at = t + laser.beam_time(i, beams).seconds();
    const Pose2 T_map_base = path.at(at), T_map_laser = T_map_base * planar(laser.T_base_laser);
    const double angle = T_map_laser.yaw + laser.angle_min + static_cast<double>(i) * laser.angle_increment;
    double range = cast(building.now, T_map_laser.position(), angle);
    for (const Walker& walker : walkers) {
      const Eigen::Vector2d middle = walker.at(T_map_base.position(), at);
      const Eigen::Vector2d stride(0.15 * std::sin(4 * at + walker.phase), 0.12);
      range = std::min(range, cast_at_leg(middle + stride, T_map_laser.position(), angle));
      range = std::min(range, cast_at_leg(middle - stride, T_map_laser.position(), angle));
    }
    if (i % 8 == 0 && std::abs(range - cast(building.mapped, T_map_laser.position(), angle)) > 0.15)
      unmapped += 8.0 / static_cast<double>(beams);
    range += sigma * noise(random);
    const bool seen = range < static_cast<double>(laser.convention.range_max);
    scan.ranges.push_back(seen ? static_cast<float>(range) : laser.convention.no_return_sentinel());
  }
  return scan;
}

}  // namespace kidnapped

/// Starts anywhere in the building; is carried to anywhere else where the options say when.
inline KidnappedDrive kidnapped_drive(const RepeatingBuilding& building, const KidnappedOptions& options) {
  std::mt19937 random(options.drive.seed);
  const double length = options.drive.speed * options.seconds;
  TruePath before(wandering(building, length, random), options.drive.speed);
  TruePath after(wandering(building, length, random), options.drive.speed);
  const KidnappedPath path(before, after, options.since.value_or(1e9), options.carried);
  KidnappedDrive drive{test::robot_with_laser(), {}, kidnapped::odometry(path, options, random), 0};
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Walker> walkers;
  for (int i = 0; i < options.drive.people; ++i)
    walkers.push_back({0.8 + 1.7 * unit(random), 6.28 * unit(random), 0.4 * (unit(random) - 0.5)});
  for (double t = 0.3; t + 0.1 < options.seconds; t += options.drive.scan_period) {
    double unmapped = 0;
    drive.scans.push_back({kidnapped::scan_at(building.walls, walkers, drive.robot, path, t,
                                              options.drive.range_sigma, random, unmapped),
                           path.at(t),
                           {}});
    drive.unmapped += unmapped;
  }
  drive.unmapped /= static_cast<double>(drive.scans.size());
  return drive;
}

}  // namespace parhelion::test

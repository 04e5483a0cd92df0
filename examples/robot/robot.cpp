#include "robot.hpp"

#include <chrono>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "cameras.hpp"
#include "description.hpp"
#include "parhelion/pose2D_t.hpp"
#include "parhelion/pose_t.hpp"
#include "parhelion/robot_t.hpp"

namespace robot {
namespace {

constexpr std::int64_t kStep = 10'000;  // us: motors and encoders
constexpr int kOdometrySteps = 5, kScanSteps = 10, kDescriptionSteps = 100;
constexpr std::int64_t kMaxLag = 200'000;       // us: a program that was held up longer does not catch up
constexpr std::int64_t kPoseSilence = 700'000;  // us without a pose: a robot that drives itself stops

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened; expected a robot description");
  return {std::istreambuf_iterator<char>(file), {}};
}

Pose2 planar(const parhelion::pose_cov_t& pose) {
  const double w = pose.orientation[0], z = pose.orientation[3];
  return {pose.pos[0], pose.pos[1], 2 * std::atan2(z, w)};
}

}  // namespace

Robot::Robot(lcm::LCM& bus, const Options& options)
    : bus_(bus),
      options_(options),
      building_(options.building),
      description_(text_of(options.description)),
      chassis_(building_.start(), options.slip, options.seed),
      random_(options.seed + 1) {
  bus_.subscribe("MR_CMD", &Robot::handle_command, this);
  bus_.subscribe("MR_SCAN", &Robot::handle_scan, this);
  bus_.subscribe("MR_JOINT_CMD", &Robot::handle_joint_command, this);
  if (options.route.empty()) return;
  Route::Settings settings;
  settings.footprint = kFootprint;
  settings.speed = options.speed;
  route_.emplace(settings, options.route);
  bus_.subscribe("POSE_COV", &Robot::handle_pose, this);
}

std::int64_t Robot::now() const {
  const auto machine = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(machine).count() +
         std::llround(1e6 * options_.clock_offset);
}

// Sets the motors first; messages from the bus are handled in the remaining time.
void Robot::run(const volatile std::sig_atomic_t& end) {
  std::int64_t next = now();
  while (!end) {
    for (std::int64_t left = next - now(); left > 0 && !end; left = next - now())
      bus_.handleTimeout(static_cast<int>((left + 999) / 1000));
    if (now() - next > kMaxLag) next = now();
    step(next);
    publish_at(next);
    next += kStep;
  }
}

void Robot::handle_command(const lcm::ReceiveBuffer*, const std::string&,
                           const parhelion::twist2D_t* command) {
  if (!watch_.receive({command->vx, command->wz}, command->utime, now())) ++refused_;
}

void Robot::handle_scan(const lcm::ReceiveBuffer*, const std::string&,
                        const parhelion::planar_lidar_t* scan) {
  if (scan->nranges != kBeams) return;  // not this robot's
  obstacles_.see_augmented(*scan, now());
  if (route_) steer(*scan, now());
}

void Robot::handle_joint_command(const lcm::ReceiveBuffer*, const std::string&,
                                 const parhelion::joints_t* command) {
  arm_.receive(*command, now());
}

void Robot::handle_pose(const lcm::ReceiveBuffer*, const std::string&, const parhelion::pose_cov_t* pose) {
  constexpr int kTracking = 1;
  if (pose->state != kTracking) return;
  T_map_odom_ = planar(*pose) * inverse(odometry_.at(pose->utime));
  localized_ = pose->utime;
}

std::optional<Pose2> Robot::T_map_base(std::int64_t utime) const {
  if (!T_map_odom_ || now() - localized_ > kPoseSilence) return std::nullopt;
  return *T_map_odom_ * odometry_.at(utime);
}

// The pose and the points of one instant: that of the scan.
void Robot::steer(const parhelion::planar_lidar_t& scan, std::int64_t now) {
  steering_ = {};
  steered_ = now;
  const auto pose = T_map_base(scan.utime);
  waits_for_ = pose ? "" : "no pose";
  if (!pose) return;
  std::vector<Point2> seen = points_of(scan, kLaserPose, kRangeMax);
  for (Point2& p : seen) p = *pose * p;
  const bool was_reached = route_->is_reached();
  steering_ = route_->drive(*pose, chassis_.twist(), seen);
  waits_for_ = route_->reason();
  if (route_->is_reached() && !was_reached) std::printf("goal reached\n"), std::fflush(stdout);
}

// Whatever the source of the command, silence means stop, and the obstacle stop comes last.
void Robot::step(std::int64_t now) {
  Twist2 command = watch_.command(now);
  const bool steered = route_ && !watch_.is_stopped(now) && now - steered_ <= CommandWatch::kSilence;
  if (route_) command = steered ? steering_ : Twist2{};
  const double part = obstacles_.allowed(command, now);
  if (part == 0 && !held_) ++obstacle_stops_;
  held_ = part == 0;
  chassis_.step({part * command.vx, part * command.wz}, 1e-6 * kStep, building_);
  arm_.step(1e-6 * kStep, now);
  truth_.add(now, chassis_.T_site_base());
}

void Robot::publish_at(std::int64_t now) {
  const std::int64_t n = steps_++;
  if (n % kDescriptionSteps == 0) {
    parhelion::robot_t description;
    description.utime = now;
    description.yaml = description_;
    bus_.publish("ROBOT", &description);
  }
  if (n % kOdometrySteps == 0) publish_odometry(now);
  if (n % kScanSteps == 0 && n > 0) publish_scan(now);
  const auto image_steps = options_.image_rate > 0 ? std::llround(100 / options_.image_rate) : 0;
  if (image_steps > 0 && n % image_steps == 7) {
    const Images images = take_images(building_, arm_.posture(), chassis_.T_site_base(), now);
    bus_.publish("CAMERA", &images.colour);
    bus_.publish("DEPTH", &images.depth);
  }
}

// The scan that ends now began as many beam intervals ago.
void Robot::publish_scan(std::int64_t now) {
  const auto sweep = std::llround(1e6 * kBeamInterval * kBeams);
  const auto scan = measure_scan(building_, truth_, now - sweep, random_);
  obstacles_.see_real(scan, now);
  bus_.publish("SCAN", &scan);
  ++scans_;
}

// The encoders' electronics stamp the value a little late.
void Robot::publish_odometry(std::int64_t now) {
  const Pose2 T_odom_base = chassis_.odometry();
  const std::int64_t stamp = now + std::llround(1e6 * options_.odometry_late);
  odometry_.add(now, T_odom_base);
  parhelion::pose2D_t odometry{};
  odometry.utime = stamp;
  odometry.x = static_cast<float>(T_odom_base.x);
  odometry.y = static_cast<float>(T_odom_base.y);
  odometry.theta = static_cast<float>(T_odom_base.yaw);
  bus_.publish("ODOMETRY", &odometry);
  const auto joints = arm_.state(now);
  bus_.publish("JOINT_STATE", &joints);
  if (options_.truth) publish_truth(now);
}

void Robot::publish_truth(std::int64_t now) {
  const Pose2& T = chassis_.T_site_base();
  parhelion::pose_t pose{};
  pose.utime = now;
  pose.pos[0] = T.x;
  pose.pos[1] = T.y;
  pose.orientation[0] = std::cos(T.yaw / 2);
  pose.orientation[3] = std::sin(T.yaw / 2);
  bus_.publish("REFERENCE_POSE", &pose);
}

std::string Robot::summary() const {
  std::ostringstream text;
  const char* goal = !route_ ? "none" : route_->is_reached() ? "reached" : "not reached";
  text << "{\"scans\": " << scans_ << ", \"driven_m\": " << chassis_.driven()
       << ", \"bumps\": " << chassis_.bumps() << ", \"obstacle_stops\": " << obstacle_stops_
       << ", \"commands_refused\": " << refused_ << ", \"goal\": \"" << goal << "\", \"waits_for\": \""
       << waits_for_ << "\"}";
  return text.str();
}

}  // namespace robot

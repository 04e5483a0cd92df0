// parse(to_yaml(x)) == x, to the bit, for any valid robot description.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "any_values.hpp"
#include "protocols/robot.hpp"

namespace parhelion {
namespace {

using namespace test;
using test::same;

LaserDescription any_laser() {
  using Sentinel = RangeConvention::Sentinel;
  LaserDescription laser;
  laser.preset = text();
  laser.T_base_laser = any_pose<Base, Laser>();
  laser.convention.range_min = between_floats(0, 1);
  laser.convention.range_max = between_floats(1.5, 90'000);
  laser.convention.no_return = any_of<Sentinel>(3);
  laser.convention.too_close = any_of<Sentinel>(3);
  if (laser.convention.no_return == Sentinel::value)
    laser.convention.no_return_value = between_floats(-1, 100);
  if (laser.convention.too_close == Sentinel::value) laser.convention.too_close_value = between_floats(-1, 1);
  laser.stamp_beam = any_of<LaserDescription::StampBeam>(3);
  laser.passes = *rc::gen::inRange(1, 65);
  laser.pass_period = between(0, 1);
  laser.beam_interval = between(-1e-3, 1e-3);
  laser.scan_period = between(0, 3);
  laser.noise_sigma = between(0, 1);
  laser.quantization = between(0, 1);
  laser.intensity_scale = between(0.001, 70'000);
  laser.intensities = *rc::gen::arbitrary<bool>();
  laser.beams = *rc::gen::inRange(0, 100'001);
  laser.angle_min = finite();
  laser.angle_increment = positive();
  laser.source = text();
  return laser;
}

bool same(const LaserDescription& a, const LaserDescription& b) {
  const RangeConvention &x = a.convention, &y = b.convention;
  return a.preset == b.preset && same(a.T_base_laser, b.T_base_laser) && x.range_min == y.range_min &&
         x.range_max == y.range_max && x.no_return == y.no_return && x.too_close == y.too_close &&
         x.no_return_value == y.no_return_value && x.too_close_value == y.too_close_value &&
         a.stamp_beam == b.stamp_beam && a.passes == b.passes && a.pass_period == b.pass_period &&
         a.beam_interval == b.beam_interval && a.scan_period == b.scan_period &&
         a.noise_sigma == b.noise_sigma && a.quantization == b.quantization &&
         a.intensity_scale == b.intensity_scale && a.intensities == b.intensities && a.beams == b.beams &&
         a.angle_min == b.angle_min && a.angle_increment == b.angle_increment && a.source == b.source;
}

CameraIntrinsics any_intrinsics() {
  CameraIntrinsics camera;
  camera.width = *rc::gen::inRange(1, 65'537);
  camera.height = *rc::gen::inRange(1, 65'537);
  camera.fx = positive();
  camera.fy = positive();
  camera.cx = finite();
  camera.cy = finite();
  camera.lens = any_of<CameraIntrinsics::Lens>(2);
  const bool fisheye = camera.lens == CameraIntrinsics::Lens::fisheye;
  for (std::size_t i = 0; i < (fisheye ? 4 : 5); ++i) camera.distortion.at(i) = finite();
  return camera;
}

bool same(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy && a.lens == b.lens && a.distortion == b.distortion;
}

std::vector<HeadJoint> any_head() {
  std::vector<HeadJoint> head;
  for (int i = *rc::gen::inRange(0, 3); i > 0; --i) {
    const double angle = between(-3, 3);
    head.push_back({"joint " + std::to_string(i),
                    {finite(), finite(), finite()},
                    {std::cos(angle), 0, std::sin(angle)}});
  }
  return head;
}

bool same(const std::vector<HeadJoint>& a, const std::vector<HeadJoint>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const HeadJoint& x, const HeadJoint& y) {
    return x.joint == y.joint && x.point == y.point && x.axis == y.axis;
  });
}

CameraDescription any_camera() {
  return {any_intrinsics(), any_pose<Base, CameraOptical>(),
          any_head(),       between(0, 60),
          between(-10, 10), between(0, 100),
          between(0, 50),   text()};
}

DepthCameraDescription any_depth() {
  return {any_intrinsics(),   any_pose<Base, DepthOptical>(),
          any_head(),         between(0, 1),
          between(2, 9),      text(),
          between(0, 100),    between(0, 0.1),
          between(0.01, 0.2), between(0, 1),
          between(0, 1)};
}

bool same(const std::optional<CameraDescription>& x, const std::optional<CameraDescription>& y) {
  if (!x || !y) return x.has_value() == y.has_value();
  return same(x->intrinsics, y->intrinsics) && same(x->T_base_optical, y->T_base_optical) &&
         same(x->head, y->head) && x->readout == y->readout && x->source == y->source &&
         x->time_offset == y->time_offset && x->rate == y->rate && x->noise == y->noise;
}

bool same(const std::optional<DepthCameraDescription>& x, const std::optional<DepthCameraDescription>& y) {
  if (!x || !y) return x.has_value() == y.has_value();
  return same(x->intrinsics, y->intrinsics) && same(x->T_base_optical, y->T_base_optical) &&
         same(x->head, y->head) && x->range_min == y->range_min && x->range_max == y->range_max &&
         x->source == y->source && x->rate == y->rate && x->noise == y->noise && x->baseline == y->baseline &&
         x->disparity_noise == y->disparity_noise && x->disparity_step == y->disparity_step;
}

/// A part of channel names: letters, digits, '_' and '-'.
std::string robot_name() {
  return *rc::gen::nonEmpty(rc::gen::container<std::string>(rc::gen::elementOf(std::string("abcXYZ0189_-"))));
}

RC_GTEST_PROP(RoundTrip, RobotDescription, ()) {
  RobotDescription a;
  a.name = robot_name().substr(0, 32);
  if (*rc::gen::arbitrary<bool>()) a.laser = any_laser();
  for (int i = a.laser ? *rc::gen::inRange(0, 4) : 0; i > 0; --i)
    a.further_lasers.push_back({"laser_" + std::to_string(i), any_laser()});
  if (*rc::gen::arbitrary<bool>()) a.line_laser = LineLaserDescription{any_laser(), any_head()};
  if (*rc::gen::arbitrary<bool>()) a.camera = any_camera();
  if (*rc::gen::arbitrary<bool>()) a.depth = any_depth();
  for (int i = *rc::gen::inRange(0, 3); i > 0; --i) {
    NamedCameras& cameras = a.further_cameras.emplace_back();
    cameras.name = "camera_" + std::to_string(i);
    const int kinds = *rc::gen::inRange(1, 4);
    if ((kinds & 1) != 0) cameras.camera = any_camera();
    if ((kinds & 2) != 0) cameras.depth = any_depth();
  }
  if (*rc::gen::arbitrary<bool>()) a.imu = ImuDescription{any_pose<Base, Imu>(), between(-10, 10)};
  if (*rc::gen::arbitrary<bool>()) a.footprint = {{0, 0}, {between(1, 2), 0}, {between(1, 2), between(1, 2)}};
  a.height = positive();
  a.mass = positive();
  a.limits = {between(0, 100), between(0, 100), between(1e-6, 100), between(0, 5)};
  a.velocity_frame = any_of<RobotDescription::VelocityFrame>(2);
  a.command_type = any_of<CommandType>(2);
  a.odometry_error_translation = positive();
  a.odometry_error_rotation = positive();
  a.source = text();

  const auto b = parse_robot_description(to_yaml(a), "r.yaml");
  RC_ASSERT(b.ok());
  RC_ASSERT(a.name == b->name && a.source == b->source);
  RC_ASSERT(a.laser.has_value() == b->laser.has_value());
  if (a.laser) RC_ASSERT(same(*a.laser, *b->laser));
  RC_ASSERT(a.further_lasers.size() == b->further_lasers.size());
  for (std::size_t i = 0; i < a.further_lasers.size(); ++i) {
    RC_ASSERT(a.further_lasers[i].name == b->further_lasers[i].name);
    RC_ASSERT(same(a.further_lasers[i].laser, b->further_lasers[i].laser));
  }
  RC_ASSERT(a.line_laser.has_value() == b->line_laser.has_value());
  if (a.line_laser) {
    RC_ASSERT(same(a.line_laser->laser, b->line_laser->laser));
    RC_ASSERT(same(a.line_laser->head, b->line_laser->head));
  }
  RC_ASSERT(same(a.camera, b->camera));
  RC_ASSERT(same(a.depth, b->depth));
  RC_ASSERT(a.further_cameras.size() == b->further_cameras.size());
  for (std::size_t i = 0; i < a.further_cameras.size(); ++i) {
    RC_ASSERT(a.further_cameras[i].name == b->further_cameras[i].name);
    RC_ASSERT(same(a.further_cameras[i].camera, b->further_cameras[i].camera));
    RC_ASSERT(same(a.further_cameras[i].depth, b->further_cameras[i].depth));
  }
  RC_ASSERT(a.imu.has_value() == b->imu.has_value());
  if (a.imu) {
    RC_ASSERT(same(a.imu->T_base_imu, b->imu->T_base_imu));
    RC_ASSERT(a.imu->time_offset == b->imu->time_offset);
  }
  RC_ASSERT(a.footprint == b->footprint);
  RC_ASSERT(a.height == b->height && a.mass == b->mass);
  RC_ASSERT(a.limits.speed == b->limits.speed && a.limits.yaw_rate == b->limits.yaw_rate);
  RC_ASSERT(a.limits.deceleration == b->limits.deceleration &&
            a.limits.reaction_time == b->limits.reaction_time);
  RC_ASSERT(a.velocity_frame == b->velocity_frame);
  RC_ASSERT(a.command_type == b->command_type);
  RC_ASSERT(a.odometry_error_translation == b->odometry_error_translation);
  RC_ASSERT(a.odometry_error_rotation == b->odometry_error_rotation);
}

}  // namespace
}  // namespace parhelion

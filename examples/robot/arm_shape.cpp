#include "arm_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace robot {
namespace {

constexpr Colour kPaint{217, 140, 26}, kSteel{153, 158, 166}, kRubber{30, 30, 30};

// The frame of the link beyond a joint.
struct Frame {
  Point3 origin;
  double yaw = 0, pitch = 0;

  Point3 at(double x, double y, double z) const {
    const double c = std::cos(pitch), s = std::sin(pitch);
    const double along = c * x - s * z, up = s * x + c * z;
    return {origin.x + std::cos(yaw) * along - std::sin(yaw) * y,
            origin.y + std::sin(yaw) * along + std::cos(yaw) * y, origin.z + up};
  }
  Frame moved(double x, double turned) const { return {at(x, 0, 0), yaw, pitch + turned}; }
  LinkBox box(double x, double y, double length, double width, double height, Colour colour) const {
    return {at(x, y, 0), yaw, pitch, length / 2, width / 2, height / 2, colour};
  }
};

// A direction, in the frame of a box.
Point3 within(const LinkBox& box, const Point3& v) {
  const double x = std::cos(box.yaw) * v.x + std::sin(box.yaw) * v.y;
  const double y = std::cos(box.yaw) * v.y - std::sin(box.yaw) * v.x;
  const double c = std::cos(box.pitch), s = std::sin(box.pitch);
  return {c * x + s * v.z, y, c * v.z - s * x};
}

// The slab method: false where the line misses the slab, or those before it.
bool clip(double from, double direction, double half, double& near, double& far) {
  if (std::abs(direction) < 1e-12) return std::abs(from) <= half;
  double a = (-half - from) / direction, b = (half - from) / direction;
  if (a > b) std::swap(a, b);
  near = std::max(near, a);
  far = std::min(far, b);
  return near <= far;
}

double range_of(const LinkBox& box, const Point3& from, const Point3& direction) {
  const Point3 p = within(box, {from.x - box.center.x, from.y - box.center.y, from.z - box.center.z});
  const Point3 v = within(box, direction);
  double near = 0, far = std::numeric_limits<double>::infinity();
  const bool meets = clip(p.x, v.x, box.half_x, near, far) && clip(p.y, v.y, box.half_y, near, far) &&
                     clip(p.z, v.z, box.half_z, near, far);
  return meets && near > 0 ? near : std::numeric_limits<double>::infinity();
}

}  // namespace

std::vector<LinkBox> link_boxes(const ArmPosture& posture) {
  const Frame turret{{0, 0, kTurretHeight + 0.03}, posture.turret, 0};
  const Frame upper{{0, 0, kShoulderHeight}, posture.turret, posture.shoulder};
  const Frame forearm = upper.moved(kUpperArm, posture.elbow);
  const Frame hand = forearm.moved(kForearm, posture.wrist);
  const double open = posture.gripper;
  return {turret.box(0, 0, 0.09, 0.09, 0.06, kSteel),
          upper.box(0.18, 0, 0.36, 0.05, 0.05, kPaint),
          forearm.box(0.16, 0, 0.32, 0.04, 0.04, kPaint),
          hand.box(0.03, 0, 0.06, 0.04, 0.04, kSteel),
          hand.box(0.075, 0, 0.03, 0.13, 0.04, kSteel),
          hand.box(0.14, open + 0.006, 0.1, 0.012, 0.03, kRubber),
          hand.box(0.14, -open - 0.006, 0.1, 0.012, 0.03, kRubber)};
}

Hit cast(const std::vector<LinkBox>& boxes, const Point3& from, const Point3& direction) {
  Hit nearest{std::numeric_limits<double>::infinity(), {}};
  for (const LinkBox& box : boxes) {
    const double range = range_of(box, from, direction);
    if (range < nearest.range) nearest = {range, box.colour};
  }
  return nearest;
}

}  // namespace robot

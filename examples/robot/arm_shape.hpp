// The arm as its own cameras see it: boxes, as in body.urdf.
#pragma once

#include <vector>

#include "arm.hpp"
#include "building.hpp"

namespace robot {

// A box whose x axis is turned by `yaw` about the vertical and then up by `pitch`.
struct LinkBox {
  Point3 center;                              // m, base_link
  double yaw = 0, pitch = 0;                  // rad
  double half_x = 0, half_y = 0, half_z = 0;  // m
  Colour colour;
};

std::vector<LinkBox> link_boxes(const ArmPosture& posture);

// Along the unit vector `direction`; both in base_link.
Hit cast(const std::vector<LinkBox>& boxes, const Point3& from, const Point3& direction);

}  // namespace robot

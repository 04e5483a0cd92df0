#include "protocols/door.hpp"

#include <cmath>

namespace parhelion {
namespace {

double opening_sign(const Hinge& hinge) {
  return hinge.upper - hinge.closed >= hinge.closed - hinge.lower ? 1 : -1;
}

}  // namespace

Hinge hinge_of(const ModelEntity& door) {
  if (door.hinge) return *door.hinge;
  constexpr double quarter = 1.5707963;  // rad, as in Hinge
  return {{-door.size.x() / 2, 0}, -quarter, quarter, 0};
}

Transform<Map, Body> leaf_at(const ModelEntity& door, const Hinge& hinge, double angle) {
  const Eigen::Vector3d axis(hinge.axis.x(), hinge.axis.y(), 0);
  Eigen::Isometry3d turned = door.T_map_body.isometry();
  turned.translate(axis).rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())).translate(-axis);
  return Transform<Map, Body>(turned);
}

double opening_of(const Hinge& hinge, double angle) { return opening_sign(hinge) * (angle - hinge.closed); }

double angle_of(const Hinge& hinge, double opening) { return hinge.closed + opening_sign(hinge) * opening; }

double leaf_reach(const ModelEntity& door, const Hinge& hinge) {
  return std::hypot(std::abs(hinge.axis.x()) + door.size.x() / 2,
                    std::abs(hinge.axis.y()) + door.size.y() / 2);
}

}  // namespace parhelion

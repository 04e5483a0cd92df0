// Shapes in the plane of a laser, and where a beam hits them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "protocols/pose2.hpp"
#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion::test {

struct Shape {
  enum class Kind : std::uint8_t { ellipse, line } kind = Kind::ellipse;
  Eigen::Vector2d a = Eigen::Vector2d::Zero(),
                  b = Eigen::Vector2d::Zero();  ///< centre and half axes; or ends
  double yaw = 0;
  Source source = Source::furniture;
  int person = -1;
  double visible = 1;  ///< fraction of beams that return
};

Shape disc(const Eigen::Vector2d& center, double radius, Source source, int person = -1);
Shape ellipse(const Pose2& pose, const Eigen::Vector2d& half_axes, Source source, int person = -1);
Shape line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, Source source, double visible = 1);
/// Four lines, `x` along the pose's heading.
void add_box(std::vector<Shape>& shapes, const Pose2& pose, double x, double y, Source source,
             int person = -1);

/// m along the beam from `o` in the direction `d` (unit); infinite where it passes.
double hit(const Shape& shape, const Eigen::Vector2d& o, const Eigen::Vector2d& d);

}  // namespace parhelion::test

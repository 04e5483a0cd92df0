// Size, level tops and filling of a thing. Internal to the objects.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fusion/semantic/objects/object_groups.hpp"

namespace parhelion::semantic {

/// The shape of a group of cubes.
struct ObjectShape {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  ///< m, map frame
  double yaw = 0;                                    ///< rad, of its longer side
  double length = 0, width = 0;                      ///< m, length >= width
  double bottom = 0, top = 0, floor = 0;             ///< m; heights are over the floor
  double plate = 0, plate_area = 0;                  ///< m over the floor, m^2: its widest level top
  double sides = 0;                                  ///< of that plate's rim: see ObjectPlate
  double plates = 0;                                 ///< m^2, of all its level tops
  double filled = 0;                                 ///< of its box's upright faces that cubes cover
  bool table = false;
  std::size_t cubes = 0;
};

ObjectShape shape_of(const ObjectGrid& grid, const ObjectGroup& group,
                     const std::vector<ObjectPlate>& plates);

}  // namespace parhelion::semantic

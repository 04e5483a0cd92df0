// Where a site lies open to the sky, as streets and yards do: no furniture of rooms stands there. Internal to
// the objects.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "protocols/model.hpp"

namespace parhelion::semantic {

class OpenGround {
 public:
  explicit OpenGround(const std::vector<ModelEntity>& entities);
  /// Whether a place of the plan (m) is outdoors: the site has wide grounds and no ceiling, and walls near
  /// the place are in less than half of all directions. A hall whose ceiling was not seen is none.
  bool contains(const Eigen::Vector2d& p) const;

 private:
  struct Segment {
    Eigen::Vector2d a, b;  ///< m
  };
  bool wide_ = false;
  std::vector<Segment> walls_;
};

}  // namespace parhelion::semantic

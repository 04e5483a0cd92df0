// The static building in Embree's bounding-volume tree: the tree finds the boxes, exact arithmetic meets
// them.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>

#include "protocols/model.hpp"

namespace parhelion {

class BuildingTree {
 public:
  struct Hit {
    double range = std::numeric_limits<double>::infinity();  ///< m; 0 inside a box
    float reflectivity = 0;
  };

  /// Empty: nothing is hit.
  BuildingTree();
  /// All entities that are not is_virtual. Poses that are not finite are left out.
  explicit BuildingTree(const SemanticModel& model);
  ~BuildingTree();
  BuildingTree(BuildingTree&&) noexcept;
  BuildingTree& operator=(BuildingTree&&) noexcept;

  /// Nearest box along a ray of the map frame (unit direction), up to max_range (m).
  Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_range) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace parhelion

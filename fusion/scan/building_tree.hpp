// The static building in Embree's bounding-volume tree: the tree finds boxes and triangles, exact arithmetic
// meets them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>

#include "protocols/model.hpp"

namespace parhelion::scan {

/// Of a model's meshes, whose material no scan tells.
inline constexpr float kMeshReflectivity = 0.5F;

class BuildingTree {
 public:
  struct Hit {
    double range = std::numeric_limits<double>::infinity();  ///< m; 0 inside a box
    float reflectivity = 0;
  };

  /// Empty: nothing is hit.
  BuildingTree();
  /// Doors need not stand where the model draws them: who knows better leaves them out and casts them as
  /// bodies.
  enum class Doors : std::uint8_t { as_drawn, left_out };
  /// All solid entities that are not is_virtual, and all meshes. What is not finite is left out.
  explicit BuildingTree(const SemanticModel& model, Doors doors = Doors::as_drawn);
  ~BuildingTree();
  BuildingTree(BuildingTree&&) noexcept;
  BuildingTree& operator=(BuildingTree&&) noexcept;

  /// Nearest box or triangle along a ray of the map frame (unit direction), up to max_range (m).
  Hit cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_range) const;

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace parhelion::scan

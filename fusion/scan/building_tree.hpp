// The static building in Embree's bounding-volume tree: the tree finds candidate boxes and triangles, exact
// arithmetic intersects them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>

#include "protocols/model.hpp"

namespace parhelion::scan {

/// For a model's meshes, whose material is unknown.
inline constexpr float kMeshReflectivity = 0.5F;

class BuildingTree {
 public:
  struct Hit {
    double range = std::numeric_limits<double>::infinity();  ///< m; 0 inside a box
    float reflectivity = 0;
  };

  /// Empty: nothing is hit.
  BuildingTree();
  /// Doors may be open at other angles than in the model; a caller that knows their angles leaves them out
  /// and casts them as bodies.
  enum class Doors : std::uint8_t { as_drawn, left_out };
  /// All solid entities that are not is_virtual, and all meshes. Non-finite ones are left out.
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

// Extends the site's point cloud and model view by view, from the robot's depth camera and swept laser.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "server/runtime/site_mapper.hpp"

namespace parhelion::runtime {

struct LiveSiteOptions {
  int pixel_step = 2;      ///< every n-th pixel of every n-th row of a depth image
  double range = 6;        ///< m along the optical axis; structured light is too noisy beyond
  double line_range = 20;  ///< m, of scan lines; beyond, a heading error of one degree matters too much
  double spacing = 0.03;   ///< m, minimum distance of points in the cloud
  std::size_t max_points = 2'000'000;  ///< limit of the cloud's size
  double largest_correction = 0.3;     ///< m, of a view's registration; a larger correction is a wrong match
  double largest_turn = 0.09;          ///< rad, the same
  double pose_sigma = 0.05;  ///< m, 1 sigma of a pose in directions that the view's surfaces leave open
  double turn_sigma = 0.01;  ///< rad, the same
  double explained = 0.15;   ///< m, a point or entity this near to a part of the model is not new
};

/// Views are registered to the cloud (fusion/cloud) starting from their poses; a view of new ground is added
/// at its pose. The initial model is kept: new entities are added where nothing is modelled yet, with names
/// that begin with "live". One thread.
class LiveSite {
 public:
  explicit LiveSite(SemanticModel start, const LiveSiteOptions& options = {});

  /// The model extended by the view; nullopt: the view shows nothing new. Errors: an image that cannot be
  /// decoded, a registration that contradicts the pose, a full cloud, no vertical or horizontal surface in
  /// the cloud yet.
  Result<std::optional<SemanticModel>> add(const SiteView& view);

  const cloud::PointCloud<Map>& cloud() const { return cloud_; }

 private:
  Result<cloud::PointCloud<Map>> seen(const SiteView& view) const;
  Result<Transform<Map, Map>> correction(const cloud::PointCloud<Map>& seen) const;
  std::size_t merge(const cloud::PointCloud<Map>& seen);
  Result<SemanticModel> model() const;

  SemanticModel start_;
  LiveSiteOptions options_;
  cloud::PointCloud<Map> cloud_;
  std::unordered_map<std::uint64_t, std::uint32_t> point_in_;  ///< by cell: index of its point in the cloud
};

}  // namespace parhelion::runtime

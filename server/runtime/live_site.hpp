// The site as the robot's depth camera and swept laser add to it: cloud and model, brought up to date view by
// view.
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
  double range = 6;        ///< m along the optical axis; structured light is noise beyond
  double line_range = 20;  ///< m, of scan lines; beyond, what a pose is off by a degree is too far
  double spacing = 0.03;   ///< m, points that are kept lie this far apart
  std::size_t most_points = 2'000'000;  ///< of the cloud; then it grows no more
  double largest_correction = 0.3;      ///< m, of a view against its pose: more is a wrong match
  double largest_turn = 0.09;           ///< rad, the same
  double pose_sigma = 0.05;             ///< m, 1 sigma of a pose where a view's surfaces leave it open
  double turn_sigma = 0.01;             ///< rad, the same
  double explained = 0.15;              ///< m, this near a part of the model a point or an entity is not new
};

/// Views come at their poses and are registered against what is there (fusion/cloud); a view of new ground
/// goes in where its pose says. The model given at the start stays: what is found is added where nothing is
/// modelled yet, under names that begin with "live". One thread.
class LiveSite {
 public:
  explicit LiveSite(SemanticModel start, const LiveSiteOptions& options = {});

  /// The whole model with the view in it; nullopt: it shows nothing new. Errors: an image that cannot be
  /// decoded, a view that fits somewhere else than its pose says, a full cloud, nothing upright or level in
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
  std::unordered_map<std::uint64_t, std::uint32_t> point_in_;  ///< by cube: its point of the cloud
};

}  // namespace parhelion::runtime

// Finds upright mirrors by the images of a site that were measured behind them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"

namespace parhelion::semantic {

/// An upright plane whose one side is the image of the other, and where the images end.
struct Mirror {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();       ///< m, map frame, a point of the plane
  Eigen::Vector2d behind = Eigen::Vector2d::UnitX();  ///< unit, towards the images
  double from = 0, to = 0;   ///< m along `along()` from `at`: through what the images were seen, or, where no
                             ///< rays are known, the stretch of the plane that was not measured
  double low = 0, high = 0;  ///< m, heights of the same
  double floor = 0, ceiling = 0;  ///< m, heights of the room before it; known where no rays are and `certain`
  double images_from = 0, images_to = 0;  ///< m along `along()` from `at`: of the images
  double depth = 0;                       ///< m, of the images behind the plane
  double alike = 0;                       ///< fraction of what is behind that is before the plane, too
  bool rays = false;                      ///< rays are known, and all that measured the images cross it
  bool certain = false;  ///< framed by its plane, and the images show less than the room does

  Eigen::Vector2d along() const { return {-behind.y(), behind.x()}; }
  /// m, behind the plane.
  double depth_of(const Eigen::Vector2d& p) const { return behind.dot(p - at); }
  /// Whether a place of the plan is among the images.
  bool has_image_at(const Eigen::Vector2d& p) const;
};

/// The mirrors of a level cloud. Candidates are the planes of flat vertical surfaces: what a mirror hangs on
/// is measured beside it. A mirror's plane has a stretch without points; what lies behind (level surfaces and
/// walls across it left out, as they are alike on both sides of anything) has its reflection before the plane
/// at three or more depths, and the plane of symmetry lies within 2.5 cm of the surface. Rooms that were
/// built alike are symmetric about the middle of the wall between them. Where rays are known (numbers of
/// scans and their viewpoints), what was seen through each opening of the plane is compared by itself. A
/// mirror is certain where its plane was measured around it, over the floor too, no farther to the front than
/// a frame is, where nine tenths are alike, and where the room shows more than its image. After Kaeshammer
/// and Nuechter 2015, "Mirror identification and correction of 3D point clouds", with geometry in place of a
/// known frame.
std::vector<Mirror> find_mirrors(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation);

/// Per point whether it is an image in one of the mirrors that are `certain`; empty: none is. An image was
/// seen through its mirror (without rays: lies at the heights of the room before it), no deeper than the
/// mirror's images, and its reflection lies within 6 cm of a cube of 6 cm with points.
std::vector<bool> seen_in_mirrors(const cloud::PointCloud<Map>& cloud, const std::vector<Mirror>& mirrors);

}  // namespace parhelion::semantic

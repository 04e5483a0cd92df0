// What each image's automatic exposure and white balance did, from surfaces that several images see.
#pragma once

#include "fusion/semantic/texture/view_geometry.hpp"

namespace parhelion::semantic {

/// A point of the surface in the views that see it.
struct Observation {
  std::uint32_t view;
  float weight;
  Eigen::Vector2d pixel;
};
struct SurfaceSample {
  Eigen::Vector3f point, normal;
  std::vector<Observation> seen;
};

/// At most `count` samples, spread evenly over the quads; those that fewer than two views see are left out.
std::vector<SurfaceSample> sample_surface(const QuadSurface& surface, std::span<const ViewGeometry> views,
                                          std::size_t count, int threads);

/// Factors by which each view's red, green and blue are multiplied, so that views agree; their mean over the
/// views is 1. A robust estimate over the logarithms, in which views that differ from most others of a sample
/// count little; saturated and dark pixels are left out.
std::vector<Eigen::Vector3f> exposure_gains(std::span<const ColourView> views,
                                            std::span<const SurfaceSample> samples);

}  // namespace parhelion::semantic

#include "server/runtime/fixed_texture.hpp"

#include <algorithm>

namespace parhelion::runtime {
namespace {

constexpr double kAround = 0.05, kOverFloor = 0.02;  // m

bool is_of(const Eigen::Vector3d& p, const ModelObject& object) {
  const Eigen::Vector3d at = object.T_map_body.inverse() * p;
  return (at.cwiseAbs() - 0.5 * object.size).maxCoeff() <= kAround &&
         at.z() > kOverFloor - object.size.z() / 2;
}

}  // namespace

std::shared_ptr<const SiteTexture> without_objects(std::shared_ptr<const SiteTexture> texture,
                                                   const std::vector<ModelObject>& objects) {
  if (!texture || objects.empty()) return texture;
  SiteTexture fixed = *texture;
  for (SiteTexture::Quad& quad : fixed.quads) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const std::uint32_t corner : quad) middle += fixed.vertices[corner].cast<double>() / 4;
    // The number of a quad tells its part of the picture: it stays in the list.
    if (std::any_of(objects.begin(), objects.end(),
                    [&](const auto& object) { return is_of(middle, object); }))
      quad.fill(quad.front());
  }
  return std::make_shared<const SiteTexture>(std::move(fixed));
}

}  // namespace parhelion::runtime

#include "fusion/cloud/free_space.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::cloud {

RangeImage::Direction RangeImage::direction(const Eigen::Vector3f& ray) {
  int axis = 0;
  ray.cwiseAbs().maxCoeff(&axis);
  const float depth = std::abs(ray[axis]);
  const auto place = [&](float x) {
    return std::clamp(static_cast<int>((x / depth + 1) * (0.5F * kSide)), 0, kSide - 1);
  };
  return {2 * axis + (ray[axis] < 0 ? 1 : 0), place(ray[(axis + 1) % 3]), place(ray[(axis + 2) % 3])};
}

RangeImage::RangeImage(const Surfels& surfels, const Eigen::Vector3d& viewpoint)
    : viewpoint_(viewpoint.cast<float>()), cells_(std::size_t{6} * kSide * kSide) {
  for (const Eigen::Vector3f& mean : surfels.means) {
    const Eigen::Vector3f ray = mean - viewpoint_;
    const float range = ray.norm();
    if (!(range > 0)) continue;
    const Direction at = direction(ray);
    Cell& c = cells_[static_cast<std::size_t>((at.face * kSide + at.v) * kSide + at.u)];
    c.nearest = c.nearest > 0 ? std::min(c.nearest, range) : range;
    c.furthest = std::max(c.furthest, range);
  }
}

RangeImage::Sight RangeImage::sight(const Eigen::Vector3f& p, float margin) const {
  const Eigen::Vector3f ray = p - viewpoint_;
  const float range = ray.norm();
  if (!(range > margin)) return Sight::unseen;
  const Direction at = direction(ray);
  const Cell& own = cell(at.face, at.u, at.v);
  if (!(own.nearest > 0)) return Sight::unseen;
  float nearest = own.nearest, furthest = own.furthest;
  for (int v = std::max(at.v - 1, 0); v <= std::min(at.v + 1, kSide - 1); ++v) {
    for (int u = std::max(at.u - 1, 0); u <= std::min(at.u + 1, kSide - 1); ++u) {
      const Cell& c = cell(at.face, u, v);
      if (!(c.nearest > 0)) continue;
      nearest = std::min(nearest, c.nearest);
      furthest = std::max(furthest, c.furthest);
    }
  }
  if (range < nearest - margin) return Sight::in_front;
  return range > furthest + margin ? Sight::behind : Sight::on_surface;
}

FreeSpace& FreeSpace::operator+=(const FreeSpace& other) {
  in_front += other.in_front;
  on_surface += other.on_surface;
  return *this;
}

FreeSpace free_space(const Surfels& seen, std::span<const Eigen::Vector3d> viewpoints, const Surfels& other,
                     const Eigen::Isometry3d& T_seen_other, double margin) {
  const Eigen::Matrix3f R = T_seen_other.linear().cast<float>();
  const Eigen::Vector3f t = T_seen_other.translation().cast<float>();
  FreeSpace sum;
  for (const Eigen::Vector3d& viewpoint : viewpoints) {
    const RangeImage image(seen, viewpoint);
    for (std::size_t i = 0; i < other.count(); ++i) {
      if (other.thickness[i] < 0) continue;
      const RangeImage::Sight sight = image.sight(R * other.means[i] + t, static_cast<float>(margin));
      sum.in_front += sight == RangeImage::Sight::in_front;
      sum.on_surface += sight == RangeImage::Sight::on_surface;
    }
  }
  return sum;
}

}  // namespace parhelion::cloud

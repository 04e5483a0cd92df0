// The semantic net of a cloud.
#pragma once

#include <stdexcept>

#include "fusion/semantic/net/semantic_net.hpp"

namespace parhelion::semantic {

/// Throws where a cloud is refused.
inline SemanticNet net_of(const cloud::PointCloud<Map>& cloud) {
  const auto surfaces = segment(cloud);
  if (!surfaces) throw std::runtime_error(surfaces.error().message);
  const auto net = label_entities(cloud, *surfaces);
  if (!net) throw std::runtime_error(net.error().message);
  return *net;
}

}  // namespace parhelion::semantic

#include "fusion/semantic/net/inclined_ceilings.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/net/ceiling_pieces.hpp"
#include "fusion/semantic/net/find_inclined_planes.hpp"

namespace parhelion::semantic {
namespace {

using Label = EntityLabel;

/// Labels the points of these planes. Per point 1 where it is one of them, else 0.
std::vector<std::uint8_t> label_points(const cloud::PointCloud<Map>& cloud,
                                       const std::vector<InclinedPlane>& planes,
                                       std::vector<std::uint8_t>& labels) {
  constexpr std::size_t kChunk = 16'384;
  const PlanesByPlace by_place(planes);
  std::vector<std::uint8_t> inclined(cloud.size(), 0);
  cloud::for_each_chunk(cloud.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!may_be_ceiling(labels[i])) continue;
      const Eigen::Vector3d p = cloud.points[i].cast<double>();
      const std::span<const std::uint32_t> here = by_place.over(PlanesByPlace::square_of(p));
      if (std::none_of(here.begin(), here.end(), [&](std::uint32_t r) { return planes[r].contains(p); }))
        continue;
      inclined[i] = 1;
      labels[i] = static_cast<std::uint8_t>(Label::ceiling);
    }
  });
  return inclined;
}

/// Removes level ceilings at whose height most ceiling points lie on inclined planes.
void drop_level_ones(const cloud::PointCloud<Map>& cloud, const std::vector<std::uint8_t>& inclined,
                     SemanticNet& net) {
  constexpr double kBand = 0.15, kKept = 0.5;  // m; of its points
  std::vector<const ModelEntity*> level;
  for (const ModelEntity& e : net.entities) {
    if (e.label == Label::ceiling) level.push_back(&e);
  }
  std::vector<double> all(level.size()), kept(level.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (net.labels[i] != static_cast<std::uint8_t>(Label::ceiling)) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    for (std::size_t k = 0; k < level.size(); ++k) {
      const Eigen::Vector3d d = p - level[k]->T_map_body.translation();
      if (std::abs(d.z() + level[k]->size.z() / 2) > kBand ||
          (d.head<2>().cwiseAbs() - 0.5 * level[k]->size.head<2>()).maxCoeff() > 0.1)
        continue;
      all[k] += 1, kept[k] += inclined[i] != 0 ? 0 : 1;
    }
  }
  std::set<std::string> gone;
  for (std::size_t k = 0; k < level.size(); ++k) {
    if (all[k] > 0 && kept[k] < kKept * all[k]) gone.insert(level[k]->name);
  }
  std::erase_if(net.entities, [&](const ModelEntity& e) { return gone.contains(e.name); });
  std::erase_if(net.evidence, [&](const LabelEvidence& e) { return gone.contains(e.entity); });
  const auto names_gone = [&](const Relation& r) { return gone.contains(r.from) || gone.contains(r.to); };
  std::erase_if(net.relations, names_gone);
  for (LabelEvidence& evidence : net.evidence) std::erase_if(evidence.supports, names_gone);
}

}  // namespace

void add_inclined_ceilings(const cloud::PointCloud<Map>& cloud, SemanticNet& net) {
  const std::vector<InclinedPlane> planes = find_inclined_planes(cloud, net.labels);
  if (planes.empty()) return;
  const std::vector<std::uint8_t> inclined = label_points(cloud, planes, net.labels);
  int number = 0;
  for (const ModelEntity& e : net.entities) number += e.label == Label::ceiling ? 1 : 0;
  drop_level_ones(cloud, inclined, net);
  for (const InclinedPlane& plane : planes) {
    const std::string name = "ceiling " + std::to_string(++number);
    std::vector<ModelEntity> pieces = ceiling_pieces(plane);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      pieces[k].name = pieces.size() == 1 ? name : name + "." + std::to_string(k + 1);
      if (pieces.size() > 1) pieces[k].part_of = name;
      net.entities.push_back(std::move(pieces[k]));
    }
  }
}

}  // namespace parhelion::semantic

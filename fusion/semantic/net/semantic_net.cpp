#include "fusion/semantic/net/semantic_net.hpp"

#include <oneapi/tbb/parallel_invoke.h>

#include <optional>

#include "fusion/semantic/net/floating_flights.hpp"
#include "fusion/semantic/net/net_entities.hpp"

namespace parhelion::semantic {

Result<SemanticNet> label_entities(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation,
                                   const SemanticNetOptions& options) {
  if (cloud.empty()) return Error{"semantic net: the cloud has no points"};
  if (segmentation.surface_of.size() != cloud.size()) {
    return Error{"semantic net: the segmentation is of " + std::to_string(segmentation.surface_of.size()) +
                 " points, the cloud has " + std::to_string(cloud.size())};
  }
  std::optional<PlanPoints> points;
  std::optional<Levels> levels;
  tbb::parallel_invoke([&] { points.emplace(cloud); }, [&] { levels.emplace(cloud, segmentation); });
  NetCandidates candidates{segmentation, *levels, {}, {}, {}};
  tbb::parallel_invoke(
      [&] {
        candidates.walls = find_wall_candidates(*points, segmentation, *levels, options);
        candidates.pillars = find_pillars(*points, candidates.walls, *levels);
      },
      [&] { candidates.flights = find_flights(cloud, segmentation, options); });
  drop_floating(*points, segmentation, *levels, candidates.flights);
  const Labelling labelling = assign_labels(candidates);
  SemanticNet net = entities_of(candidates, labelling);
  label_points(cloud, candidates, labelling, net);
  return net;
}

}  // namespace parhelion::semantic

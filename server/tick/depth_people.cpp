#include "server/tick/depth_people.hpp"

#include <algorithm>
#include <limits>

#include "render/camera_model.hpp"
#include "render/depth_image.hpp"

namespace parhelion::tick {
namespace {

// Of images at 10 Hz or more: each is 0.1 s after the one before.
constexpr Duration kPeriod = milliseconds(95);
constexpr double kTypicalRange = 3;  // m: the tracker knows one noise for all ranges

bool same(const CameraIntrinsics& a, const CameraIntrinsics& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy;
}

/// m, 1 sigma, at kTypicalRange.
double noise_of(const DepthCameraDescription& camera) {
  const double base = camera.baseline * camera.intrinsics.fx;
  const double triangulated = base > 0 ? kTypicalRange * kTypicalRange * camera.disparity_noise / base : 0;
  return std::max(camera.noise, triangulated);
}

/// The building as the slice's beams would see it. Doors are closed there: an open leaf is as wide as no
/// person.
void cast_building(const people::DepthSlice& slice, SiteState& site, std::vector<scan::RangeHit>& hits) {
  const scan::BeamSet beams{slice.scan().angle_min, slice.scan().angle_increment, slice.beam_time()};
  hits.assign(beams.time.size(), {std::numeric_limits<float>::infinity(), -1, 0});
  site.caster.cast_building(slice.motion(), beams, slice.laser().convention.range_max, hits);
}

/// Where the camera was, and how well that is known.
struct PlacedCamera {
  Transform<Map, DepthOptical> T_map_depth;
  double sigma = 0;  ///< m
};

std::optional<PlacedCamera> place(const DepthCameraDescription& camera, SensorTime t, const PoseState& pose) {
  const auto at = robot_pose(pose, t);
  const auto turn = pose::head_turn(camera.head, pose.joints, t);
  if (!at || !turn) return std::nullopt;
  const Transform<Map, DepthOptical> T_map_depth = at->T_map_base * *turn * camera.T_base_optical;
  return PlacedCamera{T_map_depth, pose::predicted_error(*at, T_map_depth.translation())};
}

void track(const TickContext& context, const people::DepthView& view, double sigma, SimulationTime taken,
           const DepthPeoplePath& path) {
  for (std::size_t i = 0; i < path.state.slices.size(); ++i) {
    people::DepthSlice& slice = path.state.slices[i];
    if (!slice.set(view)) continue;
    cast_building(slice, path.site, path.state.building);
    track_people(context,
                 {0,
                  slice.scan(),
                  slice.laser(),
                  slice.motion(),
                  slice.beam_time(),
                  path.state.building,
                  sigma,
                  taken,
                  {}},
                 path.real, {path.state.people[i], path.bystanders, path.simulation});
  }
}

}  // namespace

void DepthPeopleState::set_directions(const CameraIntrinsics& camera) {
  if (!directions.empty() && same(camera, intrinsics)) return;
  intrinsics = camera;
  directions.clear();
  const render::Lens lens(camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto direction = lens.unproject({x, y});
      const bool seen = direction && direction->z() > 0.1;  // beside it a depth along the axis says little
      directions.push_back(seen ? Eigen::Vector3f((*direction / direction->z()).cast<float>())
                                : Eigen::Vector3f(Eigen::Vector3f::Zero()));
    }
  }
}

void find_people_in_depth(const TickContext& context, const DepthCameraDescription& camera,
                          const Image& depth, const DepthPeoplePath& path) {
  const bool new_image = depth.stamp - path.state.searched >= kPeriod || depth.stamp < path.state.searched;
  if (context.configuration.scenario.level != 3 || !new_image) return;
  if (current_model(context.configuration, path.site).entities.empty()) return;
  path.state.searched = depth.stamp;
  const auto placed = place(camera, depth.stamp, path.pose);
  if (!placed) return;
  const auto pixels = render::decode_depth(depth);
  const auto intrinsics = render::intrinsics_for_size(camera.intrinsics, depth.width, depth.height);
  if (!pixels || !intrinsics) return;
  path.state.set_directions(*intrinsics);
  const people::DepthView view{pixels->width,         pixels->height,      pixels->millimetres,
                               path.state.directions, placed->T_map_depth, camera.range_min,
                               camera.range_max,      noise_of(camera)};
  track(context, view, placed->sigma, path.pose.clock.to_server(depth.stamp), path);
}

void forget_old_people_in_depth(const TickContext& context, const DepthPeoplePath& path) {
  for (PeopleState& people : path.state.people)
    forget_old_people(context, {people, path.bystanders, path.simulation});
}

}  // namespace parhelion::tick

// DEPTH to people: slices of the newest depth image, tracked like scans of planar lasers. At a step, so that
// no image waits for it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fusion/people/depth_slice.hpp"
#include "protocols/image.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/people_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Of a slice that shows nobody yet.
inline PeopleState slice_people() {
  PeopleState state;
  state.tracker = people::PeopleTracker(people::slice_people_options());
  return state;
}

/// What one depth camera shows of people.
struct DepthPeopleState {
  std::array<people::DepthSlice, 2> slices = people::depth_slices();
  std::array<PeopleState, 2> people{slice_people(), slice_people()};
  SensorTime searched;                      ///< stamp of the newest image that was searched
  CameraIntrinsics intrinsics;              ///< of `directions`
  std::vector<Eigen::Vector3f> directions;  ///< of each pixel, optical frame, z = 1
  std::vector<scan::RangeHit> building;     ///< scratch

  /// Takes time for large images: called ahead for the description's size.
  void set_directions(const CameraIntrinsics& camera);
};

/// Dependencies for one depth camera.
struct DepthPeoplePath {
  DepthPeopleState& state;
  const PoseState& pose;
  SiteState& site;
  Bystanders& bystanders;
  simulation::Simulation& simulation;
  const RealRobots& real;
};

/// Looks for people in an image at most ten times a second. Real robots only, as for scans. Images that
/// cannot be read are reported where MR_DEPTH is made.
void find_people_in_depth(const TickContext& context, const DepthCameraDescription& camera,
                          const Image& depth, const DepthPeoplePath& path);

/// At each step: see forget_old_people().
void forget_old_people_in_depth(const TickContext& context, const DepthPeoplePath& path);

}  // namespace parhelion::tick

// Made-up depth images of a furnished room with known truth: people who walk or stand, seen by a depth camera
// on a robot that turns, with the noise of triangulation. Everything follows from the seed; the image comes
// from shapes of its own, not from the program's renderer.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "fusion/people/depth_slice.hpp"
#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion::test {

struct DepthRoomOptions {
  std::uint64_t seed = 1;
  double duration = 12, rate = 10;  ///< s, Hz
  int walkers = 2, standing = 1;
  int boxes = 4, poles = 3, tables = 2;
  double height = 0.5;                          ///< m, of the camera
  double pitch = 0;                             ///< rad, down
  double tremble = 0.01;                        ///< rad, 1 sigma of pitch and roll
  double noise = 0.0015;                        ///< m at 1 m, 1 sigma; grows with the square of the range
  double pose_noise = 0.01, pose_drift = 0.02;  ///< m, 1 sigma
};

struct DepthRoomImage {
  SimulationTime stamp;
  std::vector<std::uint16_t> millimetres;
  Transform<Map, DepthOptical> T_map_depth;  ///< what the server knows: with an error
  std::vector<TruePerson> people;            ///< `beams`: number of pixels that show this person
};

struct DepthRoom {
  static constexpr int kWidth = 320, kHeight = 160;
  std::vector<Eigen::Vector3f> directions;
  double sigma = 0;              ///< m, of the poses
  Eigen::Vector2d half{4, 3.5};  ///< m: the room's walls are at +- this
  std::vector<DepthRoomImage> images;

  people::DepthView view(const DepthRoomImage& image) const;
  /// The walls on the beams of a slice.
  std::vector<scan::RangeHit> building(const people::DepthSlice& slice) const;
};

DepthRoom make_depth_room(const DepthRoomOptions& options);

}  // namespace parhelion::test

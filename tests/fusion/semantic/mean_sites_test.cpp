// The semantic model on hard made-up sites: how far it may fall short. Figures of more sites:
// docs/measurements/semantic-model.md.
#include <gtest/gtest.h>

#include "tests/degree.hpp"
#include "tests/mean_sites/mean_score.hpp"

namespace parhelion::semantic {
namespace {

using test::Device;
using test::kDegree;
using test::MeanScore;
using test::SiteKind;

MeanScore score_of(Device device) {
  MeanScore sum;
  for (const SiteKind kind : {SiteKind::flat, SiteKind::storeys, SiteKind::office, SiteKind::stair_hall})
    sum += test::score_mean_site(kind, device, 101);
  return sum;
}

TEST(MeanSites, AreScoredAtAll) {
  const MeanScore score = score_of(Device::terrestrial);
  EXPECT_EQ(score.refused, 0);
  EXPECT_GT(score.seen, 50);
  EXPECT_GT(score.raised, 1000);
  EXPECT_GT(score.steps, 3);
}

// The classifier was trained on other seeds, whose things have other proportions.
TEST(MeanSites, ThingsAreFoundAndCalledWhatTheyAre) {
  MeanScore score;
  for (const Device device : {Device::terrestrial, Device::drifting, Device::depth_camera}) {
    for (const SiteKind kind : {SiteKind::flat, SiteKind::office, SiteKind::apartment, SiteKind::yard})
      score += test::score_mean_site(kind, device, 102);
  }
  EXPECT_GT(score.objects_found, 0.65 * score.objects) << score.objects;
  EXPECT_GT(score.objects_right, 0.8 * score.objects_found) << score.objects_found;
  EXPECT_LT(score.false_objects, 0.25 * score.objects_found);
  EXPECT_LT(score.unknown, 0.15 * score.points);
}

// A slab that fell and leans against a wall is level in each cell of the plan. Without the rule about its
// slope 21 and 33 % of the points of things are called floor.
TEST(MeanSites, SteepSlabsAreNoFloor) {
  for (const Device device : {Device::terrestrial, Device::voxels_5cm}) {
    const MeanScore score = test::score_mean_site(SiteKind::rubble, device, 1);
    EXPECT_GT(score.raised, 5000);
    EXPECT_LT(score.called_floor, 0.02 * score.raised);
    EXPECT_GT(score.f1(), 0.95);
  }
}

TEST(MeanSites, RampsAreFoundAndHardlyAnythingElseIsCalledSo) {
  MeanScore score;
  for (const Device device :
       {Device::terrestrial, Device::drifting, Device::voxels_5cm, Device::depth_camera}) {
    for (const SiteKind kind : {SiteKind::ramps, SiteKind::yard, SiteKind::stair_hall})
      score += test::score_mean_site(kind, device, 103);
  }
  EXPECT_GE(score.ramps, 8);
  EXPECT_GE(score.ramps_found, 0.75 * score.ramps) << score.ramps;
  EXPECT_LT(score.slope_error, 0.5 * kDegree * score.ramps_found);
  EXPECT_LE(score.false_ramps, 1);
}

// In half of these scans half of the kerb is hidden or thinly measured: of 8 kerbs 4 are found.
TEST(MeanSites, KerbsAreFoundAndNothingElseIsCalledSo) {
  MeanScore score;
  for (const Device device : {Device::terrestrial, Device::drifting, Device::voxels_5cm, Device::sweeps}) {
    for (const std::uint64_t seed : {104U, 105U})
      score += test::score_mean_site(SiteKind::yard, device, seed);
    score += test::score_mean_site(SiteKind::stair_hall, device, 104);
    score += test::score_mean_site(SiteKind::ramps, device, 104);
  }
  EXPECT_GE(score.kerbs, 6);
  EXPECT_GE(score.kerbs_found, 0.4 * score.kerbs) << score.kerbs;
  EXPECT_LT(score.kerb_error, 0.03 * score.kerbs_found);
  EXPECT_EQ(score.false_kerbs, 0);
}

TEST(MeanSites, UpperStoreysGetTheirWallsAndDoors) {
  MeanScore score;
  for (const Device device : {Device::terrestrial, Device::drifting, Device::voxels_5cm}) {
    for (const std::uint64_t seed : {511U, 513U})
      score += test::score_mean_site(SiteKind::storeys, device, seed);
  }
  EXPECT_GT(score.f1(), 0.93) << score.precision() << " " << score.recall();
  EXPECT_GE(score.doors_found, 0.5 * score.doors) << score.doors;
  EXPECT_LT(score.unknown, 0.08 * score.points);
}

TEST(MeanSites, NeitherSomebodyWhoWalksNorARoomInAMirrorIsAWall) {
  MeanScore score;
  for (const std::uint64_t seed : {511U, 512U})
    score += test::score_mean_site(SiteKind::apartment, Device::terrestrial, seed);
  EXPECT_LT(score.crossing, 0.5);
}

// Cameras and a tilted laser see it from its side and from behind: 62 of 73 steps. On other seeds fewer, see
// the measurements.
TEST(MeanSites, AnOpenFlightIsFoundFromBehind) {
  MeanScore score;
  for (const Device device : {Device::depth_camera, Device::warped_camera, Device::sweeps}) {
    for (const std::uint64_t seed : {701U, 703U, 704U})
      score += test::score_mean_site(SiteKind::two_plans, device, seed);
  }
  EXPECT_GE(score.steps_found, 0.75 * score.steps) << score.steps;
  EXPECT_EQ(score.false_flights, 0);
  EXPECT_LT(score.rise_error, 0.01);
}

class MeanSitesBy : public testing::TestWithParam<Device> {};

TEST_P(MeanSitesBy, GetTheirWallsAndFloors) {
  const MeanScore score = score_of(GetParam());
  EXPECT_EQ(score.refused, 0);
  EXPECT_GT(score.f1(), 0.90) << score.precision() << " " << score.recall();
  EXPECT_LT(score.crossing, 0.05 * score.drawn);
  EXPECT_LT(score.called_floor, 0.02 * score.raised);
  EXPECT_LE(score.false_doors, 2);
  EXPECT_LE(score.false_pillars, 4);
  EXPECT_EQ(score.false_flights, 0);
}

// Maps of 10 cm are worse, see the measurements.
INSTANTIATE_TEST_SUITE_P(EachDevice, MeanSitesBy,
                         testing::Values(Device::terrestrial, Device::drifting, Device::unplaced,
                                         Device::voxels_5cm));

}  // namespace
}  // namespace parhelion::semantic

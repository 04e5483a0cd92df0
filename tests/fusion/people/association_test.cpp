#include "fusion/people/association.hpp"

#include <gtest/gtest.h>

#include "fusion/people/track_rules.hpp"
#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion::people {
namespace {

constexpr SimulationTime kNow{10'000'000'000};

/// Somebody with both legs, 0.2 m apart along y.
Track person_at(std::uint32_t id, double x, double y) {
  Track track;
  track.id = id;
  track.state << x, y, 0, 0;
  track.covariance.diagonal() << 0.01, 0.01, 0.1, 0.1;
  track.average_place = track.arrival_place = track.birth_place = track.position();
  track.stamp = track.seen = kNow;
  track.person = true;
  track.confirmed = kNow;
  for (const int side : {0, 1}) {
    track.legs[static_cast<std::size_t>(side)].known = true;
    track.legs[static_cast<std::size_t>(side)].offset = {0, side == 0 ? -0.1 : 0.1};
    track.legs[static_cast<std::size_t>(side)].width = 0.1;
  }
  return track;
}

Segment segment_at(double x, double y) {
  Segment segment;
  segment.center = {x, y};
  segment.width = 0.12;
  segment.range = 3;
  return segment;
}

class Parts : public testing::Test {
 protected:
  void find(double dt = 0.1) {
    evidence_.resize(segments_.size());
    parts_ = association_.find(tracks_, segments_, evidence_, dt);
  }
  double feature(std::uint32_t track, std::uint32_t slot, std::uint32_t segment, PairFeature which) const {
    for (const PossiblePart& part : parts_)
      if (part.track == track && part.slot == slot && part.segment == segment)
        return double{part.features[static_cast<std::size_t>(which)]};
    ADD_FAILURE() << "no such pair";
    return 0;
  }

  std::vector<Track> tracks_;
  std::vector<Segment> segments_;
  std::vector<SegmentEvidence> evidence_;
  Association association_;
  std::span<const PossiblePart> parts_;
};

TEST_F(Parts, are_expected_where_the_legs_were) {
  tracks_ = {person_at(1, 0, 0)};
  segments_ = {segment_at(0.05, 0.1), segment_at(3, 0)};
  find();
  EXPECT_NEAR(feature(0, 1, 0, PairFeature::distance), 0.05, 1e-6);
  EXPECT_NEAR(feature(0, 0, 0, PairFeature::distance), std::hypot(0.05, 0.2), 1e-6);
  EXPECT_NEAR(feature(0, 1, 0, PairFeature::width_change), 0.02, 1e-6);
  for (const PossiblePart& part : parts_) EXPECT_EQ(part.segment, 0U);  // the other one is out of reach
}

TEST_F(Parts, of_a_leg_that_swings_are_expected_where_it_swings_to) {
  tracks_ = {person_at(1, 0, 0)};
  tracks_[0].legs[1].swing = {1.5, 0};
  segments_ = {segment_at(0.15, 0.1)};
  find(0.1);
  EXPECT_NEAR(feature(0, 1, 0, PairFeature::distance), 0.15, 1e-6);
  EXPECT_NEAR(feature(0, 1, 0, PairFeature::swing_distance), 0, 1e-6);
}

TEST_F(Parts, know_how_near_the_parts_of_others_are) {
  tracks_ = {person_at(1, 0, 0), person_at(2, 0, 0.5)};
  segments_ = {segment_at(0, 0.38), segment_at(0, 0.12)};
  find();
  // The first is at a leg of the second person, 0.28 m from one of the first person.
  EXPECT_NEAR(feature(0, 1, 0, PairFeature::person_rival), 0.02, 1e-6);
  EXPECT_NEAR(feature(1, 0, 0, PairFeature::person_rival), 0.28, 1e-6);
  EXPECT_NEAR(feature(0, 1, 0, PairFeature::other_segment), 0.02, 1e-6);
  EXPECT_EQ(feature(0, 1, 0, PairFeature::thing_rival), 1);
  tracks_[1].person = false;
  find();
  EXPECT_EQ(feature(0, 1, 0, PairFeature::person_rival), 1);
  EXPECT_NEAR(feature(0, 1, 0, PairFeature::thing_rival), 0.02, 1e-6);
}

TEST_F(Parts, of_somebody_with_no_known_leg_are_about_the_place) {
  tracks_ = {person_at(1, 0, 0)};
  tracks_[0].legs = {};
  segments_ = {segment_at(0.3, 0)};
  find();
  ASSERT_EQ(parts_.size(), 1U);
  EXPECT_EQ(parts_[0].slot, 0U);
  EXPECT_NEAR(parts_[0].distance, 0.3, 1e-6);
}

TEST(TracksOfOnePerson, furniture_does_not_swallow_who_steps_up_to_it) {
  Track furniture = person_at(1, 0, 0), newcomer = person_at(2, 0.3, 0);
  for (Track* track : {&furniture, &newcomer}) {
    track->person = false;
    track->confirmed = {};
  }
  furniture.log_odds = -3;
  newcomer.log_odds = -1;
  EXPECT_FALSE(belongs_to(newcomer, furniture));
  EXPECT_FALSE(belongs_to(furniture, newcomer));  // nor does a newborn replace what has a history
  newcomer.log_odds = -3;                         // alike: the older one stays, and only one of them
  EXPECT_TRUE(belongs_to(newcomer, furniture));
  EXPECT_FALSE(belongs_to(furniture, newcomer));
}

TEST(TracksOfOnePerson, two_persons_who_stand_close_by_stay_two) {
  const Track older = person_at(1, 0, 0);
  EXPECT_FALSE(belongs_to(person_at(2, 0.5, 0), older));
  EXPECT_TRUE(belongs_to(person_at(2, 0.2, 0), older));
  Track part = person_at(2, 0.5, 0);
  part.person = false;
  part.confirmed = {};
  EXPECT_TRUE(belongs_to(part, older));
}

TEST(TracksOfOnePerson, two_who_have_each_been_alone_stay_two) {
  Track older = person_at(1, 0, 0), newer = person_at(2, 0.2, 0);
  for (Track* track : {&older, &newer}) {
    EXPECT_TRUE(belongs_to(newer, older));  // both have to
    track->alone = kMergeAfter.seconds();
  }
  EXPECT_FALSE(belongs_to(newer, older));
  EXPECT_FALSE(belongs_to(older, newer));
}

/// One pair at a time, the reference for PairLogOdds.
float log_odds_of(const Trees& trees, const PossiblePart& part) {
  const float first = evaluate({trees.start, trees.trees.first(PairLogOdds::kFirstTrees)}, part.features);
  if (first < PairLogOdds::kHopeless) return first;
  return evaluate({first, trees.trees.subspan(PairLogOdds::kFirstTrees)}, part.features);
}

/// Pairs at random, of which some are hopeless.
TEST(PairLogOdds, are_those_of_each_pair) {
  test::Random random(1);
  std::vector<PossiblePart> parts(203);
  for (PossiblePart& part : parts)
    for (float& value : part.features) value = static_cast<float>(random.normal());
  const Trees trees = pair_trees();
  PairLogOdds many;
  const auto log_odds = many.find(trees, parts);
  ASSERT_EQ(log_odds.size(), parts.size());
  int hopeless = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(log_odds[i], log_odds_of(trees, parts[i]));
    hopeless += log_odds[i] < PairLogOdds::kHopeless ? 1 : 0;
  }
  EXPECT_GT(hopeless, 0);
  EXPECT_LT(hopeless, static_cast<int>(parts.size()));
}

}  // namespace
}  // namespace parhelion::people

#include "fusion/people/people_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/allocations.hpp"
#include "tests/fusion/people/crowd_score.hpp"

namespace parhelion::people {
namespace {

test::CrowdOptions one_walker() {
  test::CrowdOptions options;
  options.seed = 7;
  options.walkers = 1;
  options.standing = options.robots = options.chairs = options.tables = options.poles = options.boxes = 0;
  options.bins = 0;
  options.glass = options.moving_laser = false;
  options.laser.beams = 720;
  options.room = 8;
  return options;
}

TEST(PeopleTracker, keeps_the_identity_of_one_who_walks_in_an_empty_room) {
  const test::PeopleScore score = test::score(one_walker());
  EXPECT_GE(score.recall(), 0.95);
  EXPECT_GE(score.precision(), 0.98);
  EXPECT_EQ(score.switches, 0);
  EXPECT_LE(score.first_detection(1), 0.5);
}

/// The number of the scan in which the walker is found first.
std::size_t first_scan_with_the_walker(std::uint64_t seed, double rate) {
  test::CrowdOptions options = one_walker();
  options.seed = seed;
  options.duration = 2;
  options.laser.rate = rate;
  const test::Crowd crowd = make_crowd(options);
  PeopleTracker tracker;
  for (std::size_t k = 0; k < crowd.scans.size(); ++k) {
    for (const Mover& mover : tracker.update(test::sweep_of(crowd, crowd.scans[k])))
      if (mover.kind == MoverClass::person &&
          (mover.position - crowd.scans[k].people[0].position).norm() < test::PeopleScore::kRadius)
        return k + 1;
  }
  return crowd.scans.size() + 1;
}

TEST(PeopleTracker, finds_who_is_plain_to_see_with_two_scans_of_a_slow_laser) {
  int early = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const std::size_t slow = first_scan_with_the_walker(seed, 5.5);
    EXPECT_GE(slow, 2U);
    early += slow == 2 ? 1 : 0;
    EXPECT_GE(first_scan_with_the_walker(seed, 10), 3U);
  }
  EXPECT_GE(early, 4);
}

TEST(PeopleTracker, finds_nobody_in_a_scan_that_does_not_show_them) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    test::CrowdOptions options = one_walker();
    options.seed = seed;
    options.duration = 1;
    options.laser.rate = 10;
    const test::Crowd crowd = make_crowd(options);
    PeopleTracker tracker;
    tracker.update(test::sweep_of(crowd, crowd.scans[0]));
    tracker.update(test::sweep_of(crowd, crowd.scans[1]));
    for (std::size_t k = 2; k < 5; ++k) {
      test::CrowdScan blind = crowd.scans[k];
      std::fill(blind.scan.ranges.begin(), blind.scan.ranges.end(), std::numeric_limits<float>::quiet_NaN());
      for (const Mover& mover : tracker.update(test::sweep_of(crowd, blind)))
        EXPECT_NE(mover.kind, MoverClass::person) << "seed " << seed << ", scan " << k;
    }
  }
}

TEST(PeopleTracker, estimates_velocity_and_a_covariance_that_fits) {
  test::CrowdOptions options = one_walker();
  options.duration = 60;
  const test::Crowd crowd = make_crowd(options);
  PeopleTracker tracker;
  double error = 0, normalized = 0;
  int n = 0;
  for (const test::CrowdScan& scan : crowd.scans) {
    for (const Mover& mover : tracker.update(test::sweep_of(crowd, scan))) {
      if (mover.kind != MoverClass::person || mover.seen != mover.stamp) continue;
      const Eigen::Vector2d off = mover.position - scan.people[0].position;
      error += (mover.velocity - scan.people[0].velocity).norm();
      normalized += off.squaredNorm() / mover.covariance(0, 0);
      ++n;
    }
  }
  ASSERT_GT(n, 300);
  EXPECT_LE(error / n, 0.45);
  EXPECT_LE(normalized / n, 4);  // 2 where the covariance is exact
}

TEST(PeopleTracker, gives_the_same_bits_again_and_allocates_nothing_after_warm_up) {
  test::CrowdOptions options = test::random_crowd(5);
  options.duration = 12;
  const test::Crowd crowd = make_crowd(options);
  PeopleTracker first, second;
  for (const test::CrowdScan& scan : crowd.scans) first.update(test::sweep_of(crowd, scan));
  const std::vector<Mover> once(first.movers().begin(), first.movers().end());
  for (const test::CrowdScan& scan : crowd.scans) second.update(test::sweep_of(crowd, scan));
  ASSERT_EQ(once.size(), second.movers().size());
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(once[i].id, second.movers()[i].id);
    EXPECT_EQ(std::memcmp(once[i].position.data(), second.movers()[i].position.data(), 16), 0);
  }
  // The same scans again, later: memory has its size now.
  const test::AllocationWatch watch;
  for (const test::CrowdScan& scan : crowd.scans) {
    LaserSweep sweep = test::sweep_of(crowd, scan);
    sweep.stamp = sweep.stamp + seconds(100);
    second.update(sweep);
  }
  EXPECT_EQ(watch.count(), 0U);
}

TEST(PeopleTracker, never_calls_a_known_robot_a_person) {
  test::CrowdOptions options = one_walker();
  options.walkers = 0;
  options.robots = 2;
  const test::Crowd crowd = make_crowd(options);
  PeopleTracker tracker;
  for (const test::CrowdScan& scan : crowd.scans) {
    std::vector<KnownRobot> robots;
    for (const Eigen::Vector2d& center : scan.robots) robots.push_back({center, 0.5});
    LaserSweep sweep = test::sweep_of(crowd, scan);
    sweep.robots = robots;
    for (const Mover& mover : tracker.update(sweep)) EXPECT_NE(mover.kind, MoverClass::person);
  }
}

/// 720 beams all around from the origin; `range_of(angle)` in m.
template <class RangeOf>
Scan scan_of(RangeOf&& range_of) {
  Scan scan;
  scan.angle_min = -3.14159265F;
  scan.angle_increment = 2 * 3.14159265F / 720;
  for (int i = 0; i < 720; ++i)
    scan.ranges.push_back(
        static_cast<float>(range_of(double{scan.angle_min} + i * double{scan.angle_increment})));
  return scan;
}

struct Fixture {
  LaserDescription laser;
  std::vector<float> time = std::vector<float>(720, 0.0F);
  PeopleTracker tracker;
  Fixture() { laser.convention.range_max = 20; }
  std::span<const Mover> update(const Scan& scan, double t, std::span<const scan::RangeHit> building = {}) {
    const auto T = Transform<Map, Laser>::planar(0, 0, 0, 0.2);
    return tracker.update({0, scan, laser, {T, T}, time, building, 0.01, SimulationTime{seconds(t).ns}, {}});
  }
};

/// m along a ray from the origin to a disc; infinite beside it.
double to_disc(double angle, const Eigen::Vector2d& center, double radius) {
  const Eigen::Vector2d ray(std::cos(angle), std::sin(angle));
  const double along = ray.dot(center), off2 = center.squaredNorm() - along * along;
  return along > 0 && off2 < radius * radius ? along - std::sqrt(radius * radius - off2)
                                             : std::numeric_limits<double>::infinity();
}

TEST(PeopleTracker, recognises_a_walker_who_comes_out_from_behind_a_board) {
  Fixture fixture;
  std::vector<std::uint32_t> before, after;
  for (int k = 0; k < 100; ++k) {
    const double y = -4 + 0.08 * k, swing = 0.2 * std::sin(0.5 * k);
    const Scan scan = scan_of([&](double angle) {
      if (std::abs(angle) < 0.32) return 2.0;  // hides 2 m of the way: 2.5 s
      return std::min({to_disc(angle, {2.9, y + swing}, 0.07), to_disc(angle, {3.1, y - swing}, 0.07), 19.0});
    });
    for (const Mover& mover : fixture.update(scan, 0.1 * k)) {
      if (mover.kind != MoverClass::person || mover.seen != mover.stamp) continue;
      (k < 50 ? before : after).push_back(mover.id);
    }
  }
  ASSERT_GT(before.size(), 15U);
  ASSERT_GT(after.size(), 15U);
  EXPECT_EQ(std::count(before.begin(), before.end(), before[0]), std::ssize(before));
  EXPECT_EQ(std::count(after.begin(), after.end(), before[0]), std::ssize(after));
}

/// Two come from both sides, stand 0.36 m apart with one leg behind the other, and go back.
TEST(PeopleTracker, keeps_the_identities_of_two_who_meet) {
  Fixture fixture;
  std::array<std::vector<std::uint32_t>, 2> left, right;  // before they meet, after
  for (int k = 0; k < 110; ++k) {
    const double y = 0.18 + 0.08 * (k < 40 ? 40 - k : std::max(k - 65, 0));
    const bool walk = k < 40 || k > 65;
    const double swing = walk ? 0.2 * std::sin(0.5 * k) : 0;
    const Scan scan = scan_of([&](double angle) {
      double range = 19.0;
      for (const double side : {-1.0, 1.0})
        range = std::min({range, to_disc(angle, {2.4, side * (y + swing)}, 0.07),
                          to_disc(angle, {2.6, side * (y - swing)}, 0.07)});
      return range;
    });
    for (const Mover& mover : fixture.update(scan, 0.1 * k)) {
      if (mover.kind != MoverClass::person || mover.seen != mover.stamp || (k >= 35 && k < 75)) continue;
      (mover.position.y() > 0 ? left : right)[k < 50 ? 0 : 1].push_back(mover.id);
    }
  }
  for (const auto& [before, after] : {left, right}) {
    ASSERT_GT(before.size(), 15U);
    ASSERT_GT(after.size(), 15U);
    EXPECT_EQ(std::count(before.begin(), before.end(), before[0]), std::ssize(before));
    EXPECT_EQ(std::count(after.begin(), after.end(), before[0]), std::ssize(after));
  }
}

/// One goes away. Near the place something like a leg comes up beside another person, and closer.
/// `from`, `to`: m between the two.
std::size_t persons_after_a_leg_comes_up(double from, double to) {
  Fixture fixture;
  std::size_t max_persons = 0;
  for (int k = 0; k < 130; ++k) {
    const double gone = -4 + 0.1 * k, other = std::max(5.1 - 0.1 * k, 0.3), swing = 0.2 * std::sin(0.6 * k);
    const double stride = other > 0.3 ? swing : 0, apart = std::clamp(from - 0.05 * (k - 60), to, from);
    const Scan scan = scan_of([&](double angle) {
      double range = std::min(
          {19.0, to_disc(angle, {2.4, other + stride}, 0.07), to_disc(angle, {2.6, other - stride}, 0.07)});
      if (k >= 45) return std::min(range, to_disc(angle, {2.45, other - apart}, 0.06));
      if (k >= 35) return range;
      return std::min(
          {range, to_disc(angle, {2.4, gone + swing}, 0.07), to_disc(angle, {2.6, gone - swing}, 0.07)});
    });
    const auto movers = fixture.update(scan, 0.1 * k);
    const auto persons = std::count_if(movers.begin(), movers.end(), [](const Mover& mover) {
      return mover.kind == MoverClass::person && mover.seen == mover.stamp;
    });
    if (k >= 115) max_persons = std::max(max_persons, static_cast<std::size_t>(persons));
  }
  return max_persons;
}

TEST(PeopleTracker, takes_no_leg_for_somebody_who_went_away_near_by) {
  for (const double from : {0.6, 0.65, 0.7, 0.75})
    for (const double to : {0.2, 0.25, 0.3, 0.35})
      EXPECT_EQ(persons_after_a_leg_comes_up(from, to), 1U) << from << " m, then " << to << " m";
}

TEST(PeopleTracker, notices_that_one_of_two_feet_was_set_elsewhere) {
  Fixture fixture;
  for (int k = 0; k < 120; ++k) {
    const double step = k < 80 ? 0 : 0.1;
    const Scan scan = scan_of([&](double angle) {
      return std::min({to_disc(angle, {2, 0.12}, 0.06), to_disc(angle, {2 - step, -0.12}, 0.06),
                       to_disc(angle, {-2, 0}, 0.06), 19.0});
    });
    fixture.update(scan, 0.1 * k);
  }
  ASSERT_GE(fixture.tracker.tracks().size(), 2U);
  double person = 0, pole = 0;
  for (const Track& track : fixture.tracker.tracks())
    (track.position().x() > 0 ? person : pole) = double{track.feature(TrackFeature::part_shift)};
  EXPECT_GT(person, 0.05);
  EXPECT_LT(pole, 0.01);
}

TEST(PeopleTracker, gives_no_identity_to_two) {
  test::CrowdOptions options = test::random_crowd(11);
  options.walkers = 7;
  const test::Crowd crowd = make_crowd(options);
  PeopleTracker tracker;
  for (const test::CrowdScan& scan : crowd.scans) {
    const auto movers = tracker.update(test::sweep_of(crowd, scan));
    for (std::size_t i = 1; i < movers.size(); ++i) ASSERT_LT(movers[i - 1].id, movers[i].id);
  }
}

TEST(PeopleTracker, takes_two_hundred_movers_in_one_scan) {
  Fixture fixture;
  for (int k = 0; k < 50; ++k) {
    const Scan scan = scan_of([&](double angle) {
      const double slot = std::floor((angle + 0.01 * k) / (2 * 3.14159265 / 200));
      const double within = (angle + 0.01 * k) / (2 * 3.14159265 / 200) - slot;
      return within < 0.6 ? 3 + std::fmod(std::abs(slot) * 0.7, 2.0) : 19.0;
    });
    fixture.update(scan, 0.1 * k);
    EXPECT_LE(fixture.tracker.tracks().size(), PeopleOptions{}.max_tracks);
  }
  EXPECT_GE(fixture.tracker.tracks().size(), 150U);
}

TEST(PeopleTracker, reports_nobody_inside_a_modelled_wall) {
  Fixture fixture;
  // The wall is modelled at 3 m; somebody "walks" inside and behind it.
  const std::vector<scan::RangeHit> wall(720, {3, -1, 0});
  for (int k = 0; k < 60; ++k) {
    const Scan scan = scan_of([&](double angle) {
      const double off = (angle - 0.005 * k) * 3.3;
      return std::abs(std::abs(off) - 0.12) < 0.06 ? 3.3 - 0.4 * (k % 2) : 3.0;
    });
    for (const Mover& mover : fixture.update(scan, 0.1 * k, wall)) EXPECT_LT(mover.position.norm(), 3.0);
  }
}

TEST(PeopleTracker, survives_scans_that_make_no_sense) {
  Fixture fixture;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Scan scan = scan_of([](double) { return 5.0; });
  fixture.update(scan, 1);
  EXPECT_TRUE(fixture.update(scan, 0.5).empty());  // older than the newest
  std::fill(scan.ranges.begin(), scan.ranges.end(), nan);
  fixture.update(scan, 2);
  std::fill(scan.ranges.begin(), scan.ranges.end(), 1e30F);
  fixture.update(scan, 3);
  scan.angle_increment = 0;
  std::fill(scan.ranges.begin(), scan.ranges.end(), 2.0F);
  fixture.update(scan, 4);
  scan.angle_increment = nan;
  fixture.update(scan, 5);
  scan.ranges.clear();
  EXPECT_TRUE(fixture.update(scan, 6).empty());
}

TEST(PeopleTracker, weighs_a_bounded_number_of_pairs_where_hundreds_of_segments_are_at_one_place) {
  Fixture fixture;
  Scan scan = scan_of([](double) { return 2.0; });
  scan.angle_min = -0.1F;
  scan.angle_increment = 2e-5F;
  scan.ranges.assign(10'000, 2.0F);
  for (std::size_t i = 0; i < scan.ranges.size(); i += 4) scan.ranges[i] = scan.ranges[i + 1] = 2.5F;
  for (int i = 1; i < 5; ++i) fixture.update(scan, 0.1 * i);
  EXPECT_GT(fixture.tracker.segments().size(), 300U);
  EXPECT_LE(fixture.tracker.parts().size(), 400U * 40U);
}

}  // namespace
}  // namespace parhelion::people

// One person seen by several robots is one person, with one identity.
#include "fusion/people/fused_people.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

namespace parhelion::people {
namespace {

SimulationTime at(double t) { return SimulationTime{1'000'000'000'000} + seconds(t); }

Mover person(std::uint32_t track, const Eigen::Vector2d& place, const Eigen::Vector2d& velocity, double t,
             double sigma = 0.06) {
  Mover mover;
  mover.id = track;
  mover.kind = MoverClass::person;
  mover.position = place;
  mover.velocity = velocity;
  mover.covariance.diagonal() << sigma * sigma, sigma * sigma, 0.04, 0.04;
  mover.radius = 0.25;
  mover.stamp = mover.seen = at(t);
  return mover;
}

std::set<std::uint32_t> ids(const FusedPeople& fused) {
  std::set<std::uint32_t> all;
  for (const FusedPerson& each : fused.persons()) all.insert(each.id);
  return all;
}

/// Robot 0 sees x < `left_until`, robot 1 sees x > `right_from`; somebody walks along x at 1 m/s from -4
/// to 4. The identities that he had.
std::set<std::uint32_t> walk_through(double left_until, double right_from, std::uint32_t seed,
                                     double offset = 0, std::size_t* max = nullptr) {
  FusedPeople fused;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.05);
  std::set<std::uint32_t> had;
  for (int i = 0; i < 160; ++i) {
    const double t = 0.05 * i, x = -4 + t;
    const std::size_t robot = static_cast<std::size_t>(i % 2);
    const bool sees = robot == 0 ? x < left_until : x > right_from;
    std::vector<Mover> movers;
    if (sees) {
      const Eigen::Vector2d p(x + noise(random), (robot == 1 ? offset : 0) + noise(random));
      movers.push_back(person(robot == 0 ? 5 : 9, p, {1, 0}, t));
    }
    fused.set(robot, movers, at(t));
    had.merge(ids(fused));
    if (max != nullptr) *max = std::max(*max, fused.persons().size());
  }
  return had;
}

TEST(FusedPeople, somebody_seen_by_two_robots_is_one_person) {
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    std::size_t max = 0;
    EXPECT_EQ(walk_through(2, -2, seed, 0.08, &max).size(), 1U) << seed;
    EXPECT_EQ(max, 1U) << seed;
  }
}

TEST(FusedPeople, an_identity_is_kept_from_one_robots_view_to_the_others) {
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    EXPECT_EQ(walk_through(0.3, -0.3, seed).size(), 1U) << seed;
    EXPECT_EQ(walk_through(0, 0.5, seed).size(), 1U) << seed << ": out of both views for half a second";
  }
}

TEST(FusedPeople, somebody_else_long_after_is_another_person) {
  FusedPeople fused;
  fused.set(0, std::vector{person(1, {0, 0}, {0, 0}, 0)}, at(0));
  fused.set(0, {}, at(0.1));
  EXPECT_TRUE(fused.persons().empty()) << "whom nobody sees is not shown";
  fused.set(0, {}, at(4));
  fused.set(0, std::vector{person(2, {0, 0}, {0, 0}, 4.1)}, at(4.1));
  EXPECT_EQ(ids(fused), std::set<std::uint32_t>{2});
}

TEST(FusedPeople, two_people_side_by_side_stay_two) {
  FusedPeople fused;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.05 * i;
    fused.set(static_cast<std::size_t>(i % 2),
              std::vector{person(1, {t, 0}, {1, 0}, t), person(2, {t, 0.6}, {1, 0}, t)}, at(t));
    ASSERT_EQ(ids(fused), (std::set<std::uint32_t>{1, 2})) << t;
  }
}

TEST(FusedPeople, estimates_of_two_robots_are_better_than_each) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.1);
  double alone = 0, together = 0;
  for (int i = 0; i < 400; ++i) {
    FusedPeople fused;
    const Eigen::Vector2d a(noise(random), noise(random)), b(noise(random), noise(random));
    fused.set(0, std::vector{person(1, a, {0, 0}, 0, 0.1)}, at(0));
    fused.set(1, std::vector{person(1, b, {0, 0}, 0, 0.1)}, at(0));
    if (fused.persons().size() != 1) continue;
    alone += a.squaredNorm();
    together += fused.persons().front().position.squaredNorm();
    EXPECT_EQ(fused.persons().front().sensors, 2U);
  }
  EXPECT_LT(together, 0.65 * alone);
}

/// Robot 1's pose is 1.5 m wrong until it is corrected: two persons become one, and the older identity stays.
TEST(FusedPeople, who_turns_out_to_be_one_becomes_one) {
  FusedPeople fused;
  for (int i = 0; i < 60; ++i) {
    const double t = 0.05 * i;
    fused.set(0, std::vector{person(1, {0, 0}, {0, 0}, t)}, at(t));
    fused.set(1, std::vector{person(4, {0, t < 1 ? 1.5 : 0.05}, {0, 0}, t)}, at(t));
    if (t < 1.4 || t > 1.8) {
      EXPECT_EQ(ids(fused).size(), t < 1.6 ? 2U : 1U) << t;
    }
  }
  EXPECT_EQ(ids(fused), std::set<std::uint32_t>{1});
}

/// Two people cross, and one robot's tracker mixes them up: the other's tracks keep the identities.
TEST(FusedPeople, a_track_that_leaves_its_person_is_of_another) {
  FusedPeople fused;
  for (int i = 0; i < 80; ++i) {
    const double t = 0.05 * i;
    const bool away = t > 1;
    fused.set(0, std::vector{person(1, {0, 0}, {0, 0}, t)}, at(t));
    fused.set(1, std::vector{person(3, {away ? 3.0 : 0.0, 0}, {0, 0}, t)}, at(t));
  }
  ASSERT_EQ(fused.persons().size(), 2U);
  EXPECT_NEAR(fused.persons()[0].position.x(), 0, 1e-6);
  EXPECT_EQ(fused.persons()[0].id, 1U);
  EXPECT_NEAR(fused.persons()[1].position.x(), 3, 1e-6);
}

/// The identity shown at a place, or 0.
std::uint32_t id_at(const FusedPeople& fused, const Eigen::Vector2d& place) {
  for (const FusedPerson& each : fused.persons())
    if ((each.position - place).norm() < 0.4) return each.id;
  return 0;
}

/// Two people pass each other. The first sensor's track of the one goes on with the other, whom it had not
/// seen before, and each sensor then finds who has no track of it: nobody is three people.
TEST(FusedPeople, who_leaves_with_another_is_one_of_two) {
  for (std::uint32_t seed = 1; seed <= 30; ++seed) {
    FusedPeople fused;
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 0.04);
    std::set<std::uint32_t> had;
    for (int i = 0; i < 80; ++i) {
      const double t = 0.05 * i;
      const Eigen::Vector2d p(t, 0), q(4 - t, 0.3);  // pass at 2 s
      const auto see = [&](std::uint32_t track, const Eigen::Vector2d& at_place, double speed) {
        return person(track, at_place + Eigen::Vector2d(noise(random), noise(random)), {speed, 0}, t);
      };
      std::vector<Mover> first{t < 2 ? see(3, p, 1) : see(3, q, -1)}, second{see(3, p, 1)};
      if (t > 2.6) first.push_back(see(14, p, 1)), second.push_back(see(12, q, -1));
      fused.set(0, first, at(t));
      fused.set(1, second, at(t));
      had.merge(ids(fused));
    }
    EXPECT_EQ(had.size(), 2U) << seed;
    EXPECT_EQ(ids(fused).size(), 2U) << seed;
  }
}

/// One sensor's track is taken up by another person, whom the other sensor has been following.
TEST(FusedPeople, a_track_that_jumps_to_another_person_takes_no_identity_along) {
  FusedPeople fused;
  for (int i = 0; i < 80; ++i) {
    const double t = 0.05 * i;
    const Eigen::Vector2d p(0, 0), q(1.5, 0);
    fused.set(0, std::vector{person(2, t < 2 ? p : q, {0, 0}, t)}, at(t));
    fused.set(1, std::vector{person(2, p, {0, 0}, t), person(7, q, {0, 0}, t)}, at(t));
  }
  EXPECT_EQ(id_at(fused, {0, 0}), 1U);
  EXPECT_EQ(id_at(fused, {1.5, 0}), 2U);
  EXPECT_EQ(ids(fused).size(), 2U);
}

/// Three sensors see two people who meet and part, and the tracker of the one that saw them first mixes them
/// up.
TEST(FusedPeople, the_majority_of_sensors_decides_who_is_who) {
  for (const std::size_t wrong : {0U, 1U, 2U}) {
    FusedPeople fused;
    for (int i = 0; i < 120; ++i) {
      const double t = 0.05 * i;
      const double apart = std::abs(t - 2) * 0.8 + 0.45;
      const Eigen::Vector2d p(t * 0.3, apart / 2), q(t * 0.3, -apart / 2);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t sensor = (k + wrong) % 3;
        const bool swapped = k == 0 && t > 2;
        std::vector<Mover> movers;
        if (t >= 0.2 * static_cast<double>(k))
          movers = {person(1, swapped ? q : p, {0.3, 0}, t), person(2, swapped ? p : q, {0.3, 0}, t)};
        fused.set(sensor, movers, at(t));
      }
      if (t < 1.5 || t > 3.5) {
        EXPECT_EQ(id_at(fused, p), 1U) << wrong << ", " << t;
        EXPECT_EQ(id_at(fused, q), 2U) << wrong << ", " << t;
      }
    }
  }
}

/// A track that is no person for a while and then one again is still of the same person.
TEST(FusedPeople, a_track_that_was_no_person_meanwhile_keeps_its_person) {
  FusedPeople fused;
  for (int i = 0; i < 80; ++i) {
    const double t = 0.05 * i;
    std::vector<Mover> movers;
    if (t < 1.5 || t > 3.3) movers.push_back(person(5, {2 * t, 0}, {2, 0}, t));
    fused.set(0, movers, at(t));
  }
  EXPECT_EQ(ids(fused), std::set<std::uint32_t>{1});
}

TEST(FusedPeople, what_is_no_person_is_left_out) {
  FusedPeople fused;
  Mover thing = person(1, {0, 0}, {0, 0}, 0);
  thing.kind = MoverClass::other;
  Mover robot = person(2, {1, 0}, {0, 0}, 0);
  robot.kind = MoverClass::robot;
  fused.set(0, std::vector{thing, robot}, at(0));
  EXPECT_TRUE(fused.persons().empty());
}

}  // namespace
}  // namespace parhelion::people

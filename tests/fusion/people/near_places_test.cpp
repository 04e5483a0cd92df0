#include "fusion/people/near_places.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion::people {
namespace {

/// Which of the `given` that are within `reach` of `place` are passed over, and how many others are not.
struct Missed {
  std::size_t near = 0, passed_over = 0, more = 0;
};

Missed compare(const std::vector<Eigen::Vector2d>& places, const Eigen::Vector2d& place, double reach) {
  NearPlaces near_places;
  for (const Eigen::Vector2d& each : places) near_places.add(each);
  std::vector<std::size_t> given;
  near_places.each(place, reach, [&](std::size_t i) {
    EXPECT_TRUE(given.empty() || given.back() < i);
    given.push_back(i);
    return true;
  });
  Missed missed;
  std::size_t k = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool is_given = k < given.size() && given[k] == i;
    k += is_given ? 1 : 0;
    const bool near = !((places[i] - place).norm() > reach);  // what is not finite, too
    missed.near += near ? 1 : 0;
    missed.passed_over += near && !is_given ? 1 : 0;
    missed.more += is_given && !near ? 1 : 0;
  }
  EXPECT_EQ(k, given.size());
  return missed;
}

TEST(NearPlaces, gives_all_that_are_near_and_hardly_any_other) {
  test::Random random(1);
  Missed sum;
  for (int round = 0; round < 400; ++round) {
    const double size = round % 4 == 3 ? 1e5 : 20, reach = random.uniform(0.3, 2);
    const Eigen::Vector2d origin(random.uniform(-size, size), random.uniform(-size, size));
    std::vector<Eigen::Vector2d> places;
    for (int i = random.integer(0, 60); i > 0; --i)
      places.emplace_back(origin + Eigen::Vector2d(random.uniform(-5, 5), random.uniform(-5, 5)));
    // One at the limit, and one that makes no sense.
    const Eigen::Vector2d place = origin + Eigen::Vector2d(random.uniform(-5, 5), random.uniform(-5, 5));
    places.emplace_back(place + Eigen::Vector2d(reach * (1 - 1e-9), 0));
    if (random.chance(0.2)) places.emplace_back(std::numeric_limits<double>::quiet_NaN(), 0);
    if (random.chance(0.2)) places.insert(places.begin(), Eigen::Vector2d(1e6, -1e6));
    const Missed missed = compare(places, place, reach);
    sum.near += missed.near;
    sum.passed_over += missed.passed_over;
    // A place that is far from the first one has a large error of rounding.
    if (places.front().x() < 2e5) sum.more += missed.more;
  }
  EXPECT_GT(sum.near, 400U);
  EXPECT_EQ(sum.passed_over, 0U);
  EXPECT_LE(sum.more, sum.near / 50);
}

TEST(NearPlaces, passes_over_what_is_far_although_the_first_place_makes_no_sense) {
  for (const double wrong :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    std::vector<Eigen::Vector2d> places{{wrong, 0}, {0, wrong}};
    for (int i = 0; i < 1000; ++i) places.emplace_back(20 + i, -7);
    const Missed missed = compare(places, {40, -7}, 1.5);
    EXPECT_EQ(missed.passed_over, 0U);
    EXPECT_LE(missed.more, 2U) << "of 999 that are far";
  }
}

TEST(NearPlaces, ends_where_it_is_asked_to) {
  NearPlaces places;
  for (int i = 0; i < 9; ++i) places.add({0.1 * i, 0});
  int given = 0;
  places.each({0, 0}, 5, [&](std::size_t) { return ++given < 3; });
  EXPECT_EQ(given, 3);
  places.clear();
  places.each({0, 0}, 5, [&](std::size_t) { return ++given < 3; });
  EXPECT_EQ(given, 3);
}

}  // namespace
}  // namespace parhelion::people

// Stamps, transforms, results: what must not compile, and edge cases of what does.
#include <gtest/gtest.h>

#include <type_traits>

#include "protocols/frames.hpp"
#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion {
namespace {

template <class A, class B>
concept CanMultiply = requires(A a, B b) {
  a* b;
};
template <class A, class B>
concept CanSubtract = requires(A a, B b) {
  a - b;
};
template <class A, class B>
concept CanCompare = requires(A a, B b) {
  a < b;
};

using MapBase = Transform<Map, Base>;
using BaseLaser = Transform<Base, Laser>;

static_assert(CanMultiply<MapBase, BaseLaser>);
static_assert(!CanMultiply<BaseLaser, MapBase>, "a chain whose inner frames differ must not compile");
static_assert(!CanMultiply<MapBase, MapBase>);
static_assert(!CanMultiply<MapBase, Transform<Odom, Base>>);
static_assert(std::is_same_v<decltype(MapBase() * BaseLaser()), Transform<Map, Laser>>);
static_assert(std::is_same_v<decltype(MapBase().inverse()), Transform<Base, Map>>);
static_assert(!std::is_convertible_v<MapBase, Transform<Odom, Base>>);
static_assert(!std::is_convertible_v<Eigen::Isometry3d, MapBase>, "frames are said, not guessed");

static_assert(CanSubtract<SensorTime, SensorTime> && CanCompare<SensorTime, SensorTime>);
static_assert(!CanSubtract<SensorTime, ArrivalTime>, "two clocks must not mix");
static_assert(!CanCompare<SensorTime, ArrivalTime>);
static_assert(!CanSubtract<SimulationTime, WallTime>);
static_assert(!std::is_convertible_v<ArrivalTime, SensorTime>);

TEST(Time, UtimeRoundsTowardsNegativeInfinity) {
  EXPECT_EQ(SensorTime{1999}.utime(), 1);
  EXPECT_EQ(SensorTime{2000}.utime(), 2);
  EXPECT_EQ(SensorTime{0}.utime(), 0);
  EXPECT_EQ(SensorTime{-1}.utime(), -1);
  EXPECT_EQ(SensorTime{-1000}.utime(), -1);
  EXPECT_EQ(SensorTime{-1001}.utime(), -2);
  for (const std::int64_t us : {-3, 0, 7, 1'136'391'912}) EXPECT_EQ(SensorTime::from_utime(us).utime(), us);
}

TEST(Time, SecondsAreRoundedToTheNearestNanosecond) {
  EXPECT_EQ(seconds(0.1).ns, 100'000'000);
  EXPECT_EQ(seconds(-0.1).ns, -100'000'000);
  EXPECT_EQ(seconds(1.0 / 240).ns, 4'166'667);
  EXPECT_EQ((SensorTime{5} + nanoseconds(3) - SensorTime{1}).ns, 7);
}

TEST(Frames, ChainedTransformsCancelAndInvert) {
  const auto T_map_base = MapBase::planar(1, 2, 0.5);
  const auto T_base_laser = BaseLaser::planar(0.3, 0, -0.1, 0.2);
  const auto T_map_laser = T_map_base * T_base_laser;
  EXPECT_NEAR(T_map_laser.yaw(), 0.4, 1e-15);
  EXPECT_NEAR(T_map_laser.translation().x(), 1 + 0.3 * std::cos(0.5), 1e-15);
  EXPECT_NEAR(T_map_laser.translation().z(), 0.2, 1e-15);
  const auto identity = T_map_laser * T_map_laser.inverse();
  EXPECT_TRUE(identity.isometry().isApprox(Eigen::Isometry3d::Identity(), 1e-14));
}

TEST(Frames, InterpolationTakesTheShorterRotation) {
  const auto a = MapBase::planar(0, 0, 3.0);
  const auto b = MapBase::planar(2, 0, -3.0);
  const auto middle = interpolate(a, b, 0.5);
  EXPECT_NEAR(std::abs(middle.yaw()), std::numbers::pi, 1e-12);
  EXPECT_NEAR(middle.translation().x(), 1, 1e-15);
  EXPECT_TRUE(interpolate(a, b, 0).isometry().isApprox(a.isometry(), 1e-12));
  EXPECT_TRUE(interpolate(a, b, 1).isometry().isApprox(b.isometry(), 1e-12));
}

TEST(Frames, WrappedAnglesLieInHalfOpenCircle) {
  EXPECT_DOUBLE_EQ(wrap_angle(std::numbers::pi), std::numbers::pi);
  EXPECT_DOUBLE_EQ(wrap_angle(-std::numbers::pi), std::numbers::pi);
  EXPECT_NEAR(wrap_angle(7), 7 - 2 * std::numbers::pi, 1e-15);
  EXPECT_NEAR(wrap_angle(-100.5 * std::numbers::pi), -0.5 * std::numbers::pi, 1e-12);
}

TEST(Frames, ANonFiniteTransformIsRefused) {
  Eigen::Isometry3d broken = Eigen::Isometry3d::Identity();
  EXPECT_TRUE(MapBase(broken).finite());
  broken.translation().y() = NAN;
  EXPECT_FALSE(MapBase(broken).finite());
}

TEST(Status, AResultHoldsAValueOrAnError) {
  const Result<int> good = 3;
  const Result<int> bad = Error{"scan.yaml:3: no"};
  ASSERT_TRUE(good);
  EXPECT_EQ(*good, 3);
  ASSERT_FALSE(bad);
  EXPECT_EQ(bad.error().message, "scan.yaml:3: no");
  EXPECT_TRUE(Status());
  EXPECT_FALSE(Status(Error{"no"}));
}

}  // namespace
}  // namespace parhelion

// The statistics of `parhelion topic`.
#include "tools/channel_statistics.hpp"

#include <gtest/gtest.h>

#include "protocols/codec.hpp"

namespace parhelion::tools {
namespace {

Message odometry_message(std::int64_t arrival_us, std::int64_t stamp_us) {
  Message message{"ODOMETRY", ArrivalTime::from_utime(arrival_us), {}};
  encode(Odometry{SensorTime::from_utime(stamp_us), {}}, message.payload);
  return message;
}

TEST(ChannelStatistics, ARegularChannelHasItsRateAndNoJitter) {
  ChannelStatistics channel;
  for (int i = 0; i < 101; ++i) channel.add(odometry_message(5'000'000 + i * 20'000, 1'000'000 + i * 20'000));
  EXPECT_EQ(channel.count(), 101U);
  EXPECT_EQ(channel.type(), "pose2D_t");
  EXPECT_EQ(channel.bytes(), 101U * 28U);
  EXPECT_DOUBLE_EQ(channel.rate(), 50);
  EXPECT_NEAR(channel.jitter(), 0, 1e-12);
  EXPECT_EQ(channel.lost(), 0U);
}

TEST(ChannelStatistics, LossIsDetectedFromSensorStampsNotArrivals) {
  ChannelStatistics late, missing;
  for (int i = 0; i < 50; ++i) late.add(odometry_message(i * 20'000 + (i > 25 ? 100'000 : 0), i * 20'000));
  for (int i = 0; i < 50; ++i) {
    if (i != 10 && i != 30 && i != 31) missing.add(odometry_message(i * 20'000, i * 20'000 + i % 3 * 500));
  }
  EXPECT_EQ(late.lost(), 0U);
  EXPECT_DOUBLE_EQ(late.longest(), 0.12);
  EXPECT_DOUBLE_EQ(late.shortest(), 0.02);
  EXPECT_EQ(missing.lost(), 3U);
}

TEST(ChannelStatistics, OneMessageHasNoRate) {
  ChannelStatistics channel;
  channel.add({"X", ArrivalTime::from_utime(1), {1, 2}});
  EXPECT_EQ(channel.rate(), 0);
  EXPECT_EQ(channel.jitter(), 0);
  EXPECT_EQ(channel.longest(), 0);
  EXPECT_EQ(channel.lost(), 0U);
  EXPECT_EQ(channel.type(), "none");
  channel.add(odometry_message(2, 2));
  EXPECT_EQ(channel.type(), "mixed");
}

TEST(ChannelStatistics, ConstantOrBackwardStampsAreNoLoss) {
  ChannelStatistics still, back;
  for (int i = 0; i < 10; ++i) still.add(odometry_message(i * 1000, 7));
  for (int i = 0; i < 10; ++i) back.add(odometry_message(i * 1000, (i % 5) * 1000));
  EXPECT_EQ(still.lost(), 0U);
  EXPECT_EQ(back.lost(), 0U);
}

}  // namespace
}  // namespace parhelion::tools

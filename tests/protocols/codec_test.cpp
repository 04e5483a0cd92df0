// What a decoder takes and what it refuses, on the scan; the other types follow the same reader.
#include "protocols/codec.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace parhelion {
namespace {

Scan sample_scan() {
  Scan scan;
  scan.stamp = SensorTime::from_utime(1'136'391'912'123'456);
  scan.ranges = {1.5F,
                 0.0F,
                 81.83F,
                 std::numeric_limits<float>::infinity(),
                 -std::numeric_limits<float>::infinity(),
                 std::numeric_limits<float>::quiet_NaN(),
                 -1.0F};
  scan.angle_first = -1.5F;
  scan.angle_step = 0.5F;
  return scan;
}

TEST(ScanCodec, KeepsEveryBitOfARange) {
  const Scan scan = sample_scan();
  std::vector<std::uint8_t> bytes;
  encode(scan, bytes);
  Scan decoded;
  const Status status = decode("SCAN", bytes, decoded);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(decoded.stamp, scan.stamp);
  ASSERT_EQ(decoded.ranges.size(), scan.ranges.size());
  EXPECT_EQ(std::memcmp(decoded.ranges.data(), scan.ranges.data(), scan.ranges.size() * 4), 0);
  EXPECT_EQ(decoded.angle_first, scan.angle_first);
  EXPECT_EQ(decoded.angle_step, scan.angle_step);
}

TEST(ScanCodec, RefusesEveryTruncation) {
  std::vector<std::uint8_t> bytes;
  encode(sample_scan(), bytes);
  Scan decoded;
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_FALSE(decode("SCAN", Bytes(bytes).first(n), decoded)) << n << " bytes";
  }
}

TEST(Codec, AForeignFingerprintIsNamedWithChannelAndBothFingerprints) {
  std::vector<std::uint8_t> bytes;
  encode(Odometry{}, bytes);
  Scan scan;
  const Status status = decode("SCAN", bytes, scan);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message.find(
                "channel SCAN: planar_lidar_t: fingerprint 0x1f317af1246276ac, expected 0x"),
            0U)
      << status.error().message;
}

}  // namespace
}  // namespace parhelion

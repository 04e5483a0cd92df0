// Our bag reader compared with ROS's own, librosbag_storage.
#include <gtest/gtest.h>
#include <ros/time.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <algorithm>
#include <array>
#include <random>

#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tools/import/rosbag_reader.hpp"

namespace parhelion::tools {
namespace {

/// A message of arbitrary bytes: ROS's own messages with strings or arrays are not valid C++20.
struct Blob {
  std::vector<std::uint8_t> bytes;
};

}  // namespace
}  // namespace parhelion::tools

namespace ros {
namespace message_traits {
template <>
struct MD5Sum<parhelion::tools::Blob> {
  static const char* value() { return "0123456789abcdef0123456789abcdef"; }
  static const char* value(const parhelion::tools::Blob&) { return value(); }
};
template <>
struct DataType<parhelion::tools::Blob> {
  static const char* value() { return "test_msgs/Blob"; }
  static const char* value(const parhelion::tools::Blob&) { return value(); }
};
template <>
struct Definition<parhelion::tools::Blob> {
  static const char* value() { return "uint8[] bytes"; }
  static const char* value(const parhelion::tools::Blob&) { return value(); }
};
}  // namespace message_traits
namespace serialization {
template <>
struct Serializer<parhelion::tools::Blob> {
  static void write(OStream& stream, const parhelion::tools::Blob& blob) {
    std::copy(blob.bytes.begin(), blob.bytes.end(),
              stream.advance(static_cast<std::uint32_t>(blob.bytes.size())));
  }
  static std::uint32_t serializedLength(const parhelion::tools::Blob& blob) {
    return static_cast<std::uint32_t>(blob.bytes.size());
  }
};
}  // namespace serialization
}  // namespace ros

namespace parhelion::tools {
namespace {

using test::TemporaryFolder;

struct Read {
  std::int64_t received = 0;  // ns
  std::string topic, type;
  std::vector<std::uint8_t> bytes;
  auto operator<=>(const Read&) const = default;
};

/// In order of time, as librosbag returns them; ours returns them in file order.
std::vector<Read> by_rosbag(const std::filesystem::path& path) {
  rosbag::Bag bag(path.string(), rosbag::bagmode::Read);
  std::vector<Read> all;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
    Read read{static_cast<std::int64_t>(message.getTime().toNSec()), message.getTopic(),
              message.getDataType(), std::vector<std::uint8_t>(message.size())};
    ::ros::serialization::OStream stream(read.bytes.data(), message.size());
    message.write(stream);
    all.push_back(std::move(read));
  }
  std::sort(all.begin(), all.end());
  return all;
}

struct Ours {
  std::vector<Read> messages;
  int damages = 0;
};

Ours by_us(const std::filesystem::path& path) {
  Ours ours;
  auto bag = BagReader::open(path);
  EXPECT_TRUE(bag.ok());
  BagMessage message;
  while (bag) {
    const auto more = bag->next(message);
    if (!more) {
      ++ours.damages;
    } else if (*more) {
      ours.messages.push_back({message.received.ns,
                               message.topic,
                               message.type,
                               {message.bytes.bytes.begin(), message.bytes.bytes.end()}});
    } else {
      break;
    }
  }
  std::sort(ours.messages.begin(), ours.messages.end());
  return ours;
}

void expect_the_same(const std::filesystem::path& path, std::size_t min_messages) {
  const auto theirs = by_rosbag(path);
  const Ours ours = by_us(path);
  EXPECT_EQ(ours.damages, 0);
  ASSERT_GE(theirs.size(), min_messages);
  ASSERT_EQ(ours.messages.size(), theirs.size());
  for (std::size_t i = 0; i < theirs.size(); ++i) ASSERT_EQ(ours.messages[i], theirs[i]) << i;
}

constexpr std::size_t kWrittenMessages = 600;

/// Three topics, unordered stamps, empty and large messages, several chunks.
void write_bag(const std::filesystem::path& path, rosbag::CompressionType compression) {
  rosbag::Bag bag;
  bag.setCompression(compression);
  bag.setChunkThreshold(16 * 1024);
  bag.open(path.string(), rosbag::bagmode::Write);
  constexpr std::array<const char*, 3> topics{"/blob", "/other/blob", "/third"};
  std::mt19937 random(5);
  for (std::size_t i = 0; i < kWrittenMessages; ++i) {
    const auto n = static_cast<std::uint32_t>(i);
    const ::ros::Time time(1'600'000'000 + n / 10 + random() % 2, random() % 1'000'000'000);
    Blob blob;
    blob.bytes.resize(i % 100 == 1 ? 40'000 : random() % 300);
    for (std::uint8_t& byte : blob.bytes) byte = static_cast<std::uint8_t>(random() % 7);
    bag.write(topics.at(i % topics.size()), time, blob);
  }
  bag.close();
}

class BagReaderReference : public ::testing::TestWithParam<rosbag::CompressionType> {};

TEST(BagReader, ReadingARecordedBagEqualsRosbag) {
  const auto path = test::recording("rosbag-jarvis-circular/jarvis_circular_path_fast.bag");
  PARHELION_NEEDS_RECORDING(path);
  expect_the_same(path, 1000);
}

TEST_P(BagReaderReference, ReadingAWrittenBagEqualsRosbag) {
  const TemporaryFolder folder;
  write_bag(folder / "written.bag", GetParam());
  expect_the_same(folder / "written.bag", kWrittenMessages);
}

std::vector<char> without_index(std::vector<char> bytes) {
  constexpr std::string_view name = "index_pos=";
  const auto at = std::search(bytes.begin(), bytes.end(), name.begin(), name.end());
  std::fill_n(at + static_cast<std::ptrdiff_t>(name.size()), 8, '\0');
  return bytes;
}

/// The reason for our own reader: the recorder writes the index when it closes a bag, and librosbag returns
/// no message without the complete index. A bag whose recorder crashed has none (BagUnindexedException); a
/// bag truncated afterwards refers to an index beyond the end of the file (BagIOException).
TEST_P(BagReaderReference, ReadsATruncatedBagThatRosbagRefuses) {
  const TemporaryFolder folder;
  write_bag(folder / "whole.bag", GetParam());
  const auto whole = by_us(folder / "whole.bag").messages;
  const auto bytes = test::file_bytes(folder / "whole.bag");
  std::size_t before = 0;
  for (const double fraction : {0.2, 0.5, 0.8}) {
    auto cut = bytes;
    cut.resize(static_cast<std::size_t>(fraction * static_cast<double>(bytes.size())));
    test::write_bytes(folder / "died.bag", without_index(cut));
    EXPECT_THROW(by_rosbag(folder / "died.bag"), rosbag::BagUnindexedException) << fraction;
    test::write_bytes(folder / "cut.bag", cut);
    EXPECT_THROW(by_rosbag(folder / "cut.bag"), rosbag::BagIOException) << fraction;
    const auto ours = by_us(folder / "cut.bag").messages;
    EXPECT_EQ(by_us(folder / "died.bag").messages, ours);
    EXPECT_GT(ours.size(), before);
    EXPECT_LT(ours.size(), whole.size());
    EXPECT_TRUE(std::includes(whole.begin(), whole.end(), ours.begin(), ours.end()));
    before = ours.size();
  }
}

std::string name_of(const ::testing::TestParamInfo<rosbag::CompressionType>& compression) {
  constexpr std::array<const char*, 3> names{"none", "bz2", "lz4"};
  return names.at(compression.param);
}
INSTANTIATE_TEST_SUITE_P(Compressions, BagReaderReference,
                         ::testing::Values(rosbag::compression::Uncompressed, rosbag::compression::BZ2,
                                           rosbag::compression::LZ4),
                         name_of);

}  // namespace
}  // namespace parhelion::tools

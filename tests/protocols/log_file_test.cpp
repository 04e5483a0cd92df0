// Event logs: written events are read back, and damage only affects the damaged part.
#include "protocols/bus/log_file.hpp"

#include <gtest/gtest.h>
#include <lcm/eventlog.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <numbers>
#include <random>

#include "protocols/codec.hpp"
#include "tests/recordings.hpp"

namespace parhelion {
namespace {

namespace fs = std::filesystem;

class LogFile : public ::testing::Test {
 protected:
  void SetUp() override {
    // In memory where possible: thousands of small files are written.
    const fs::path parent = fs::is_directory("/dev/shm") ? "/dev/shm" : fs::temp_directory_path();
    std::string pattern = (parent / "parhelion-log-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  fs::path folder_;
};

Message sample(int i) {
  Message message{"CHANNEL_" + std::to_string(i % 7), ArrivalTime::from_utime(1'000'000 + i), {}};
  message.payload.resize(static_cast<std::size_t>(i * 13 % 200), static_cast<std::uint8_t>(i));
  return message;
}

std::vector<std::uint8_t> read_all(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_all(const std::string& path, std::span<const std::uint8_t> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

std::string write_samples(const std::string& path, int n) {
  auto writer = LogWriter::create(path, false);
  EXPECT_TRUE(writer) << writer.error().message;
  for (int i = 0; i < n; ++i) {
    const Message message = sample(i);
    EXPECT_TRUE(writer->write(message.channel, message.arrival, message.payload));
  }
  return path;
}

struct Read {
  std::vector<Message> events;
  std::vector<std::string> errors;
  std::uint64_t skipped = 0;
};

Read read_log(const std::string& path) {
  Read read;
  auto reader = LogReader::open(path);
  EXPECT_TRUE(reader) << reader.error().message;
  while (true) {
    auto event = reader->next();
    if (!event) {
      read.errors.push_back(event.error().message);
    } else if (!event->has_value()) {
      break;
    } else {
      read.events.push_back(std::move(**event));
    }
  }
  EXPECT_EQ(reader->offset(), reader->size());
  read.skipped = reader->skipped_bytes();
  return read;
}

bool equal(const Message& a, const Message& b) {
  return a.channel == b.channel && a.arrival == b.arrival && a.payload == b.payload;
}

TEST_F(LogFile, ReadsBackWhatWasWritten) {
  const Read read = read_log(write_samples(path("a.lcm"), 500));
  ASSERT_EQ(read.events.size(), 500U);
  EXPECT_TRUE(read.errors.empty());
  for (int i = 0; i < 500; ++i) EXPECT_TRUE(equal(read.events[static_cast<std::size_t>(i)], sample(i))) << i;
}

TEST_F(LogFile, OverwritesOnlyOnRequest) {
  write_samples(path("a.lcm"), 3);
  const auto refused = LogWriter::create(path("a.lcm"), false);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("a.lcm: exists"), std::string::npos) << refused.error().message;
  EXPECT_EQ(read_log(path("a.lcm")).events.size(), 3U);
  const Message message = sample(7);
  ASSERT_TRUE(
      LogWriter::create(path("a.lcm"), true)->write(message.channel, message.arrival, message.payload));
  EXPECT_EQ(read_log(path("a.lcm")).events.size(), 1U);
}

TEST_F(LogFile, AnOverwrittenFileIsKeptUntilTheFirstEvent) {
  const auto before = read_all(write_samples(path("a.lcm"), 3));
  ASSERT_TRUE(LogWriter::create(path("a.lcm"), true));
  EXPECT_EQ(read_all(path("a.lcm")), before);
}

TEST_F(LogFile, AFileWithoutEventsIsRemovedAgain) {
  ASSERT_TRUE(LogWriter::create(path("a.lcm"), false));
  EXPECT_FALSE(fs::exists(path("a.lcm")));
}

TEST_F(LogFile, AnotherFileOfTheSameNameIsNotRemoved) {
  {
    const auto writer = LogWriter::create(path("a.lcm"), false);
    ASSERT_TRUE(writer);
    fs::remove(path("a.lcm"));
    write_all(path("a.lcm"), std::vector<std::uint8_t>{1, 2, 3});
  }
  EXPECT_EQ(read_all(path("a.lcm")).size(), 3U);
}

TEST_F(LogFile, TwoWritersOfOneFileAreRefused) {
  const auto first = LogWriter::create(path("a.lcm"), false);
  ASSERT_TRUE(first);
  const auto second = LogWriter::create(path("a.lcm"), true);
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().message.find("another program"), std::string::npos);
}

TEST_F(LogFile, SeveralEventsAreWrittenInOrder) {
  std::vector<Message> messages;
  for (int i = 0; i < 50; ++i) messages.push_back(sample(i));
  auto writer = LogWriter::create(path("a.lcm"), false);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->write(messages));
  const Read read = read_log(path("a.lcm"));
  ASSERT_EQ(read.events.size(), messages.size());
  for (std::size_t i = 0; i < messages.size(); ++i) EXPECT_TRUE(equal(read.events[i], messages[i])) << i;
}

TEST_F(LogFile, ABatchWithAnInvalidMessageWritesNothing) {
  auto writer = LogWriter::create(path("a.lcm"), false);
  ASSERT_TRUE(writer);
  const std::vector<Message> messages = {sample(1), Message{std::string(64, 'x'), {}, {}}};
  EXPECT_FALSE(writer->write(messages));
  EXPECT_FALSE(writer->write("", {}, {}));
  EXPECT_EQ(fs::file_size(path("a.lcm")), 0U);
}

TEST_F(LogFile, EveryTruncationKeepsWholeEventsAndReportsTheOffset) {
  const auto whole = read_all(write_samples(path("whole.lcm"), 12));
  std::vector<std::size_t> ends = {0};
  for (int i = 0; i < 12; ++i)
    ends.push_back(ends.back() + 28 + sample(i).channel.size() + sample(i).payload.size());
  ASSERT_EQ(ends.back(), whole.size());
  for (std::size_t n = 0; n < whole.size(); ++n) {
    write_all(path("cut.lcm"), std::span(whole).first(n));
    const Read read = read_log(path("cut.lcm"));
    const auto complete =
        static_cast<std::size_t>(std::upper_bound(ends.begin(), ends.end(), n) - ends.begin()) - 1;
    ASSERT_EQ(read.events.size(), complete) << n << " bytes";
    const bool at_an_end = ends[complete] == n;
    ASSERT_EQ(read.errors.size(), at_an_end ? 0U : 1U) << n << " bytes";
    if (!at_an_end) {
      EXPECT_NE(
          read.errors[0].find("cut.lcm: byte " + std::to_string(ends[complete]) + ": the file ends within"),
          std::string::npos)
          << read.errors[0];
      EXPECT_EQ(read.skipped, n - ends[complete]);
    }
  }
}

TEST_F(LogFile, ABitFlipLosesAtMostItsEvent) {
  constexpr int events = 40;
  const auto whole = read_all(write_samples(path("whole.lcm"), events));
  std::mt19937 random(7);
  for (int trial = 0; trial < 4000; ++trial) {
    auto damaged = whole;
    const std::size_t bit = random() % (whole.size() * 8);
    damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    write_all(path("flipped.lcm"), damaged);
    const Read read = read_log(path("flipped.lcm"));
    int intact = 0;
    std::size_t at = 0;
    for (int i = 0; i < events; ++i) {
      while (at < read.events.size() && !equal(read.events[at], sample(i))) {
        const bool found_later =
            std::any_of(read.events.begin() + static_cast<std::ptrdiff_t>(at), read.events.end(),
                        [i](const Message& m) { return equal(m, sample(i)); });
        if (!found_later) break;
        ++at;
      }
      if (at < read.events.size() && equal(read.events[at], sample(i))) ++intact, ++at;
    }
    // A length that grew by exactly the size of the following events cannot be distinguished from a correct
    // one.
    const bool swallowed = read.errors.empty() && read.events.size() < events;
    EXPECT_GE(intact, swallowed ? static_cast<int>(read.events.size()) - 1 : events - 1) << "bit " << bit;
  }
}

TEST_F(LogFile, RandomBytesAreReadWithoutACrash) {
  std::mt19937 random(11);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::uint8_t> rubbish(random() % 3000);
    for (auto& byte : rubbish) byte = static_cast<std::uint8_t>(random());
    for (std::size_t i = 0; i + 4 < rubbish.size(); i += 97) {
      const std::uint8_t sync[] = {0xED, 0xA1, 0xDA, 0x01};
      std::copy(std::begin(sync), std::end(sync), rubbish.begin() + static_cast<std::ptrdiff_t>(i));
    }
    write_all(path("rubbish"), rubbish);
    const Read read = read_log(path("rubbish"));
    EXPECT_LE(read.skipped, rubbish.size());
  }
}

TEST_F(LogFile, AFileThatIsNoLogIsRefusedByName) {
  const auto absent = LogReader::open(path("absent.lcm"));
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().message.find("absent.lcm: cannot be opened"), std::string::npos);
  EXPECT_FALSE(LogReader::open(folder_.string()));
}

struct CloseLog {
  void operator()(lcm_eventlog_t* log) const { lcm_eventlog_destroy(log); }
};
using LiblcmLog = std::unique_ptr<lcm_eventlog_t, CloseLog>;

/// Reads with liblcm and with LogReader, event by event.
void expect_agreement(const std::string& path) {
  const LiblcmLog liblcm(lcm_eventlog_create(path.c_str(), "r"));
  ASSERT_NE(liblcm, nullptr);
  const Read read = read_log(path);
  EXPECT_TRUE(read.errors.empty());
  std::size_t i = 0;
  for (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(liblcm.get()); event != nullptr;
       event = lcm_eventlog_read_next_event(liblcm.get()), ++i) {
    ASSERT_LT(i, read.events.size());
    const auto* data = static_cast<const std::uint8_t*>(event->data);
    const Message theirs{std::string(event->channel, static_cast<std::size_t>(event->channellen)),
                         ArrivalTime::from_utime(event->timestamp),
                         {data, data + event->datalen}};
    EXPECT_TRUE(equal(theirs, read.events[i])) << "event " << i;
    lcm_eventlog_free_event(event);
  }
  EXPECT_EQ(i, read.events.size());
}

TEST_F(LogFile, LiblcmReadsTheSameFromWrittenLogs) { expect_agreement(write_samples(path("a.lcm"), 300)); }

TEST_F(LogFile, LiblcmReadsTheSameFromLogsOfARealRobot) {
  for (const char* name : {"lcm-mbot/drive_square_odometry.lcmlog", "lcm-mbot/lcmlog-2022-02-14.04"}) {
    PARHELION_NEEDS_RECORDING(test::recording(name));
    expect_agreement(test::recording(name).string());
  }
}

// Figures of the recording's ATTRIBUTION.md, from an independent parser.
TEST_F(LogFile, TheOdometryOfARealRobotIsDecodedWithOurType) {
  const auto log = test::recording("lcm-mbot/drive_square_odometry.lcmlog");
  PARHELION_NEEDS_RECORDING(log);
  const Read read = read_log(log.string());
  EXPECT_EQ(read.events.size(), 45246U);
  EXPECT_TRUE(read.errors.empty());
  double path_length = 0;
  Eigen::AlignedBox2d box;
  Odometry last;
  int count = 0;
  for (const Message& event : read.events) {
    if (event.channel != "ODOMETRY") continue;
    Odometry odometry;
    const Status status = decode(event.channel, event.payload, odometry);
    ASSERT_TRUE(status) << status.error().message;
    const Eigen::Vector2d position = odometry.T_odom_base.translation().head<2>();
    if (count++ > 0) {
      EXPECT_GE(odometry.stamp, last.stamp);
      path_length += (position - last.T_odom_base.translation().head<2>()).norm();
    }
    box.extend(position);
    last = odometry;
  }
  EXPECT_NEAR(count, 50 * 179.6, 5);
  EXPECT_NEAR(path_length, 12.87, 0.005);
  EXPECT_NEAR(box.sizes().x(), 0.83, 0.005);
  EXPECT_NEAR(box.sizes().y(), 0.87, 0.005);
  EXPECT_NEAR(last.T_odom_base.translation().x(), -0.009, 0.0005);
  EXPECT_NEAR(last.T_odom_base.translation().y(), 0.027, 0.0005);
}

// Checks units and axes by physics: at rest gravity has the direction given by the attitude, and the yaw
// changes at the measured rate.
TEST_F(LogFile, TheImuOfARealRobotIsMappedToOurUnitsAndAxes) {
  const auto log = test::recording("lcm-mbot/drive_square_odometry.lcmlog");
  PARHELION_NEEDS_RECORDING(log);
  const Read read = read_log(log.string());
  int count = 0, at_rest = 0;
  Eigen::Vector3d tilt_error = Eigen::Vector3d::Zero();
  double turned = 0, turned_by_rate = 0;
  Eigen::Quaterniond last = Eigen::Quaterniond::Identity();
  SensorTime last_stamp;
  for (const Message& event : read.events) {
    if (event.channel != "MBOT_IMU") continue;
    ImuSample sample;
    const Status status = decode("IMU", event.payload, sample);
    ASSERT_TRUE(status) << status.error().message;
    ASSERT_TRUE(sample.orientation);
    if (sample.rotation_rate.norm() < 0.01 && std::abs(sample.acceleration.norm() - 9.7) < 0.1) {
      ++at_rest;
      tilt_error += *sample.orientation * sample.acceleration.normalized() - Eigen::Vector3d::UnitZ();
    }
    if (count++ > 0) {
      const Eigen::AngleAxisd turn(last.conjugate() * *sample.orientation);
      turned += std::abs(turn.angle() * turn.axis().z());
      turned_by_rate += std::abs(sample.rotation_rate.z()) * (sample.stamp - last_stamp).seconds();
    }
    last = *sample.orientation;
    last_stamp = sample.stamp;
  }
  EXPECT_EQ(count, 8977);
  ASSERT_GT(at_rest, 300);
  EXPECT_LT((tilt_error / at_rest).norm(), 0.02) << at_rest << " samples at rest";
  EXPECT_GT(turned, 4 * 2 * std::numbers::pi * 0.8) << "four laps of a square";
  EXPECT_NEAR(turned_by_rate / turned, 1, 0.15);
}

}  // namespace
}  // namespace parhelion

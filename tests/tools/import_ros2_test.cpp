// Recordings of ROS 2: databases, MCAP files, folders of several, compressed or damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <zstd.h>

#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tests/tools/mutation_samples.hpp"
#include "tests/tools/process.hpp"
#include "tools/export/mcap_records.hpp"
#include "tools/import/bag_source.hpp"
#include "tools/robot/check_description.hpp"
#include "tools/robot/log_survey.hpp"

namespace parhelion::tools {
namespace {

using test::ImportedLog;
using test::TemporaryFolder;
using test::WrittenBag;
using ::testing::HasSubstr;

std::string zstd(const std::string& bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  return packed;
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_metadata(const std::filesystem::path& folder, const std::vector<std::string>& files) {
  std::string text = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n";
  for (const std::string& file : files) text += "    - " + file + "\n";
  test::write_text(folder / "metadata.yaml", text);
}

/// The recording's events, without the description, which names the source.
std::vector<Message> imported(const std::filesystem::path& input, const TemporaryFolder& folder) {
  auto options = test::import_options(input, folder / "out.lcm");
  options.overwrite = true;
  const auto report = import_recording(options, {});
  EXPECT_TRUE(report.ok()) << input << ": " << (report.ok() ? "" : report.error().message);
  if (!report) return {};
  EXPECT_EQ(report->refused, 0U) << input;
  std::vector<Message> events = ImportedLog(folder / "out.lcm").events;
  if (!events.empty()) events.erase(events.begin());
  return events;
}

void expect_same(const std::vector<Message>& events, const std::vector<Message>& expected,
                 const std::string& what) {
  ASSERT_EQ(events.size(), expected.size()) << what;
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].channel, expected[i].channel) << what << ", event " << i;
    EXPECT_EQ(events[i].payload, expected[i].payload) << what << ", event " << i;
    EXPECT_EQ(events[i].arrival.ns, expected[i].arrival.ns) << what << ", event " << i;
  }
}

/// `stamp`: of the scans' and transforms' headers; `received`: of the first.
WrittenBag bag_with_tf(std::uint32_t stamp, std::uint32_t received) {
  WrittenBag bag;
  for (std::uint32_t i = 0; i < 5; ++i) {
    test::RosBytes scan, moved;
    scan.header(stamp, 0, "laser");
    for (const float value : {-1.0F, 1.0F, 0.5F, 0.0F, 0.1F, 0.2F, 30.0F}) scan.add(value);
    scan.array<float>({1, 2, 3, 4, 5}).array<float>({});
    moved.add(std::uint32_t{1})
        .header(stamp, 0, "odom")
        .text("base_link")
        .doubles({0.1 * i, 0, 0, 0, 0, 0, 1});
    bag.add("/tf", "tf2_msgs/TFMessage", received + i, moved);
    bag.add("/scan", "sensor_msgs/LaserScan", received + i, scan);
  }
  return bag;
}

/// ROS writes zero where a driver sets no stamp. An instant of zero would be believed by all that follows.
TEST(ImportRos2, MessagesWithoutAStampGetTheTimeOfRecordingAndANote) {
  const TemporaryFolder folder;
  bag_with_tf(0, 100).write(folder / "in.bag");
  bag_with_tf(0, 100).write_database(folder / "in.db3");
  for (const char* file : {"in.bag", "in.db3"}) {
    auto options = test::import_options(folder / file, folder / "out.lcm");
    options.overwrite = true;
    const auto report = import_recording(options, {});
    ASSERT_TRUE(report.ok()) << report.error().message;
    const ImportedLog log(folder / "out.lcm");
    for (const char* channel : {"SCAN", "ODOMETRY"}) {
      std::vector<std::int64_t> stamps;
      for (const Message& event : log.events)
        if (event.channel == channel) stamps.push_back(leading_stamp(event.payload)->utime());
      EXPECT_EQ(stamps,
                (std::vector<std::int64_t>{100'000'005, 101'000'005, 102'000'005, 103'000'005, 104'000'005}))
          << file << ", " << channel;
      EXPECT_THAT(report->notes,
                  testing::Contains(HasSubstr(std::string(channel) + ": 5 of its messages have no stamp")))
          << file;
    }
  }
}

TEST(ImportRos2, TheSameMessagesGiveTheSameLogWhateverTheFormat) {
  const TemporaryFolder folder;
  const WrittenBag bag = test::small_bag();
  bag.write(folder / "in.bag");
  const auto expected = imported(folder / "in.bag", folder);
  ASSERT_GT(expected.size(), 10U);

  bag.write_database(folder / "in.db3");
  expect_same(imported(folder / "in.db3", folder), expected, "database");
  bag.write_database(folder / "packed.db3", 0, bag.size(), zstd);
  expect_same(imported(folder / "packed.db3", folder), expected, "compressed messages");
  test::write_text(folder / "in.db3.zstd", zstd(text_of(folder / "in.db3")));
  expect_same(imported(folder / "in.db3.zstd", folder), expected, "compressed file");
  for (const McapCompression each : {McapCompression::none, McapCompression::lz4, McapCompression::zstd}) {
    bag.write_mcap(folder / "in.mcap", {each, 500, ""});
    expect_same(imported(folder / "in.mcap", folder), expected,
                "MCAP, compression " + std::to_string(static_cast<int>(each)));
  }
  bag.write_mcap(folder / "in.mcap", {McapCompression::none, 500, ""}, zstd);
  expect_same(imported(folder / "in.mcap", folder), expected, "MCAP, compressed messages");
  const std::string database = text_of(folder / "in.db3");
  test::write_text(folder / "two.db3.zstd", zstd(database.substr(0, 5000)) + zstd(database.substr(5000)));
  expect_same(imported(folder / "two.db3.zstd", folder), expected, "a file of two frames");
}

TEST(ImportRos2, AFolderIsReadInTheOrderOfItsMetadata) {
  const TemporaryFolder folder;
  const WrittenBag bag = test::small_bag();
  bag.write(folder / "in.bag");
  const auto expected = imported(folder / "in.bag", folder);
  const std::filesystem::path split = folder / "drive";
  std::filesystem::create_directory(split);
  bag.write_database(split / "drive_0.db3", 0, 6);
  bag.write_database(split / "drive_1.db3", 6, 11);
  bag.write_database(split / "drive_10.db3", 11);
  expect_same(imported(split, folder), expected, "without metadata");
  std::filesystem::rename(split / "drive_0.db3", split / "z.db3");
  write_metadata(split, {"drive/z.db3", "drive_1.db3", "drive_10.db3"});
  expect_same(imported(split, folder), expected, "in the order of the metadata");

  std::filesystem::remove(split / "drive_1.db3");
  const auto missing = import_recording(test::import_options(split, folder / "none.lcm"), {});
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error().message, HasSubstr("metadata.yaml:5: 'drive_1.db3' is missing"));
  for (const char* itself : {".", "~", "''", "../drive"}) {
    write_metadata(split, {itself});
    EXPECT_FALSE(import_recording(test::import_options(split, folder / "none.lcm"), {}).ok()) << itself;
  }
}

TEST(ImportRos2, AFolderOfPicturesIsNoRecordingOfRos) {
  const TemporaryFolder folder;
  test::small_bag().write_database(folder / "left_here.db3");
  EXPECT_EQ(recognise_recording(folder / ".").value(), ImportFormat::rosbag);
  test::write_text(folder / "frame-000000.color.png", "a picture");
  EXPECT_EQ(recognise_recording(folder / ".").value(), ImportFormat::rgbd);
}

TEST(ImportRos2, ARecordingThatIsCutOffIsReadUpToThere) {
  const TemporaryFolder folder;
  const WrittenBag bag = test::small_bag();
  bag.write_mcap(folder / "in.mcap", {McapCompression::none, 500, ""});
  const std::string whole = text_of(folder / "in.mcap");
  bag.write_mcap(folder / "all.mcap", {});
  const std::size_t all = imported(folder / "all.mcap", folder).size();
  std::filesystem::create_directory(folder / "cut");
  const std::filesystem::path cut = folder / "cut/in.mcap";
  test::write_text(cut, whole.substr(0, whole.size() * 2 / 5));
  const auto report = import_recording(test::import_options(cut, folder / "cut.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(report->kept(), 2U);
  EXPECT_LT(report->kept(), all);
  ASSERT_EQ(report->refusals.size(), 1U);
  EXPECT_THAT(report->refusals[0].why, HasSubstr("cut off"));
  EXPECT_EQ(report->damaged, 1U);

  // A script must learn that half of the recording is missing.
  const auto run = [&](const std::filesystem::path& in) {
    return test::run({"import", in, "-o", folder / "run.lcm", "--force"}, folder / "said.txt");
  };
  const auto failed = run(cut);
  EXPECT_EQ(failed.exit, 1);
  EXPECT_THAT(failed.output, HasSubstr("is cut off or damaged at 1 place"));
  EXPECT_TRUE(std::filesystem::exists(folder / "run.lcm")) << "what could be read";
  EXPECT_EQ(run(folder / "all.mcap").exit, 0);
}

TEST(ImportRos2, NothingIsWrittenBesideADatabaseWithAWriteAheadLog) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "drive");
  const std::filesystem::path path = folder / "drive/in.db3";
  test::small_bag().write_database(path);
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  sqlite3_exec(database, "PRAGMA journal_mode=WAL", nullptr, nullptr, nullptr);
  sqlite3_close(database);
  EXPECT_GT(imported(path, folder).size(), 10U);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "drive"), {}), 1);
}

/// As a recorder leaves it that is killed: all messages are in the log only.
void write_unmerged(const WrittenBag& bag, const std::filesystem::path& folder,
                    const std::filesystem::path& path) {
  const std::filesystem::path live = folder / "live.db3", rows = folder / "rows.db3";
  bag.write_database(rows);
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(live.c_str(), &database), SQLITE_OK);
  const std::string copy = "PRAGMA journal_mode=WAL; PRAGMA wal_autocheckpoint=0; ATTACH '" + rows.string() +
                           "' AS rows; CREATE TABLE topics AS SELECT * FROM rows.topics; "
                           "CREATE TABLE messages AS SELECT * FROM rows.messages";
  ASSERT_EQ(sqlite3_exec(database, copy.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  std::filesystem::copy_file(live, path);
  std::filesystem::copy_file(live.string() + "-wal", path.string() + "-wal");
  sqlite3_close(database);
}

TEST(ImportRos2, TheWriteAheadLogOfAKilledRecorderIsRead) {
  const TemporaryFolder folder;
  const WrittenBag bag = test::small_bag();
  bag.write(folder / "in.bag");
  const auto expected = imported(folder / "in.bag", folder);
  write_unmerged(bag, folder / ".", folder / "in.db3");
  const std::string database = text_of(folder / "in.db3"), log = text_of(folder / "in.db3-wal");
  expect_same(imported(folder / "in.db3", folder), expected, "with its log");
  EXPECT_EQ(text_of(folder / "in.db3"), database);
  EXPECT_EQ(text_of(folder / "in.db3-wal"), log);
}

TEST(ImportRos2, ADatabaseWhoseMessagesAreComputedIsRefused) {
  const TemporaryFolder folder;
  const std::string path = folder / "in.db3";
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  const char* endless =
      "CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT);"
      "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) "
      "SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data FROM n";
  ASSERT_EQ(sqlite3_exec(database, endless, nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(database);
  const auto report = import_recording(test::import_options(path, folder / "out.lcm"), {});
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error().message, HasSubstr("no tables 'topics' and 'messages'"));
}

TEST(ImportRos2, AChunkWithinAChunkIsRefused) {
  const TemporaryFolder folder;
  const auto chunk_of = [](const std::string& records) {
    std::string content(16, '\0');
    mcap::put(content, static_cast<std::uint64_t>(records.size()));
    mcap::put(content, std::uint32_t{0});
    mcap::put_text(content, "");
    mcap::put(content, static_cast<std::uint64_t>(records.size()));
    std::string record;
    mcap::put_record(record, mcap::Opcode::chunk, content + records);
    return record;
  };
  const std::string inner = chunk_of(std::string(5000, '\x0F')), outer = chunk_of(inner + inner);
  test::write_text(folder / "in.mcap", std::string(mcap::kMagic) + outer);
  auto bag = open_bag(folder / "in.mcap");
  ASSERT_TRUE(bag.ok());
  BagMessage message;
  const auto refused = (*bag)->next(message);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("byte 8: a record at byte 0 of the chunk"));
  EXPECT_FALSE((*bag)->next(message).value());
}

TEST(ImportRos2, WhatIsNoRecordingIsRefusedWithTheFileAndWhatWasExpected) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& text) {
    test::write_text(folder / name, text);
    const auto report = import_recording(test::import_options(folder / name, folder / "none.lcm"), {});
    EXPECT_FALSE(report.ok()) << name;
    return report.ok() ? "" : report.error().message;
  };
  EXPECT_THAT(refusal("a.db3", std::string("SQLite format 3\0 and no more", 30)), HasSubstr("a.db3"));
  EXPECT_THAT(refusal("b.mcap", "\x89MCAP0\r\n"), HasSubstr("no message"));
  const std::string packed = refusal("c.db3.zstd", zstd("no recording"));
  EXPECT_THAT(packed, HasSubstr("a .bag, .db3 or .mcap file"));
  EXPECT_THAT(packed, HasSubstr("c.db3.zstd"));
  EXPECT_FALSE(std::filesystem::exists(folder / "none.lcm"));
}

TEST(ImportRos2, WritesTheUrdfThatTheRecordingHasOrFails) {
  const TemporaryFolder folder;
  WrittenBag bag = test::small_bag();
  bag.write_database(folder / "none.db3");
  auto options = test::import_options(folder / "none.db3", folder / "out.lcm");
  options.urdf = folder / "robot.urdf";
  const auto none = import_recording(options, {});
  ASSERT_FALSE(none.ok());
  EXPECT_THAT(none.error().message, HasSubstr("no URDF on a topic robot_description"));
  bag.add("/robot_description", "std_msgs/String", 100, test::RosBytes().text("<robot/>"));
  bag.write_database(folder / "in.db3");
  options.input = folder / "in.db3";
  const auto written = import_recording(options, {});
  ASSERT_TRUE(written.ok()) << written.error().message;
  EXPECT_EQ(text_of(options.urdf), "<robot/>");
}

TEST(ImportRos2, OfStaticTransformsThatContradictTheLastIsUsedWithANote) {
  const TemporaryFolder folder;
  WrittenBag bag = test::small_bag();
  test::RosBytes other;
  other.add(std::uint32_t{1}).header(100, 0, "base_link").text("laser").doubles({0.7, 0, 0.2, 0, 0, 0, 1});
  bag.add("/tf_static", "tf2_msgs/TFMessage", 104, other);
  bag.write_database(folder / "in.db3");
  const auto report = import_recording(test::import_options(folder / "in.db3", folder / "out.lcm"), {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(report->notes,
              ::testing::Contains(HasSubstr("tf_static has different poses of laser in base_link")));
  const RobotDescription robot = ImportedLog(folder / "out.lcm").robot();
  EXPECT_TRUE(robot.laser->T_base_laser.translation().isApprox(Eigen::Vector3d(0.7, 0, 0.2), 1e-12));
}

TEST(ImportRos2, ATurtleBot4IsImportedWithItsTurnedLaser) {
  const auto recorded = test::recording("r2-turtlebot4-macfirst");
  PARHELION_NEEDS_RECORDING(recorded);
  const TemporaryFolder folder;
  auto options = test::import_options(recorded, folder / "out.lcm");
  options.urdf = folder / "robot.urdf";
  const auto report = import_recording(options, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_THAT(text_of(options.urdf), HasSubstr("<robot name=\"turtlebot4\">"));
  EXPECT_EQ(report->read, 2425U);
  EXPECT_EQ(report->refused, 0U);
  EXPECT_EQ(report->find(channel::kScan)->kept, 357U);
  EXPECT_EQ(report->find(channel::kScan)->beams.at(720), 357U);
  EXPECT_EQ(report->find(channel::kOdometry)->kept, 920U);
  const RobotDescription robot = ImportedLog(folder / "out.lcm").robot();
  EXPECT_NEAR(robot.laser->T_base_laser.yaw(), M_PI / 2, 1e-3);
  EXPECT_NEAR(robot.laser->T_base_laser.translation().z(), 0.139, 0.001);
  EXPECT_LT(robot.laser->beam_interval, 0) << "its driver reverses the beams";

  const auto shipped =
      load_robot_description(std::string(PARHELION_SOURCE_DIR) + "/examples/robot/turtlebot4_lite.yaml");
  ASSERT_TRUE(shipped.ok()) << shipped.error().message;
  const auto log = survey_log(folder / "out.lcm");
  ASSERT_TRUE(log.ok()) << log.error().message;
  EXPECT_THAT(
      check_description(*shipped, *log).contradictions,
      ::testing::UnorderedElementsAre(HasSubstr("no messages on CAMERA"), HasSubstr("no messages on DEPTH"),
                                      HasSubstr("no messages on IMU"), HasSubstr("laser range_max")))
      << "what was not recorded, and ranges beyond the data sheet's";
}

TEST(ImportRos2, ANeatoWithMessagesThatNobodyKnowsIsImported) {
  const auto recorded = test::recording("r2-neato/ari-wall-follower");
  PARHELION_NEEDS_RECORDING(recorded);
  const TemporaryFolder folder;
  auto options = test::import_options(recorded, folder / "out.lcm");
  options.topics["SCAN"] = "/scan";
  const auto report = import_recording(options, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->find(channel::kScan)->kept, 97U);
  EXPECT_EQ(report->find(channel::kOdometry)->kept, 105U);
  EXPECT_EQ(report->left_out.at("/bump (neato2_interfaces/Bump)"), 105U);
  // Its description and its driver contradict each other.
  const auto place = ImportedLog(folder / "out.lcm").robot().laser->T_base_laser.translation();
  EXPECT_NEAR(place.x(), -0.084, 1e-6);
}

TEST(ImportRos2, OneTransformSequenceIsTheSameFromBothVersions) {
  const auto bag = test::recording("r2-evo/tf_example.bag"), folder2 = test::recording("r2-evo/tf_example");
  PARHELION_NEEDS_RECORDING(bag);
  const TemporaryFolder folder;
  const auto expected = imported(bag, folder);
  EXPECT_EQ(expected.size(), 517U);
  expect_same(imported(folder2, folder), expected, "tf_example");
}

/// Number of messages of a file.
std::uint64_t count(const std::filesystem::path& path) {
  auto bag = open_bag(path);
  EXPECT_TRUE(bag.ok()) << (bag.ok() ? "" : bag.error().message);
  if (!bag) return 0;
  BagMessage message;
  for (;;) {
    const auto more = (*bag)->next(message);
    EXPECT_TRUE(more.ok()) << (more.ok() ? "" : more.error().message);
    if (!more || !*more) return (*bag)->messages();
  }
}

TEST(BagSource, ReadsTheContainersOfRosbag2sOwnTests) {
  const auto root = test::recording("r2-rosbag2-resources");
  PARHELION_NEEDS_RECORDING(root);
  std::map<std::string, std::uint64_t> counts;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".db3") || name.ends_with(".mcap") || name.ends_with(".db3.zstd"))
      counts[entry.path().lexically_relative(root).string()] = count(entry.path());
  }
  EXPECT_GE(counts.size(), 35U);
  std::multiset<std::uint64_t> all;
  for (const auto& [name, messages] : counts) all.insert(messages);
  // As its ATTRIBUTION.md counts them: split by size, split by time.
  for (const std::uint64_t known : {1246U, 1240U, 1108U, 1324U, 529U})
    EXPECT_TRUE(all.contains(known)) << known;
}

}  // namespace
}  // namespace parhelion::tools

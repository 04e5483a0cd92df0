// Damaged recordings, session logs, maps and clouds; see mutated_files.hpp.
#include "tests/tools/mutated_files.hpp"

#include <cstdio>

#include "server/review/review.hpp"
#include "server/runtime/play/player.hpp"
#include "server/runtime/replay.hpp"
#include "server/runtime/session_record.hpp"
#include "tests/fusion/cloud/las_bytes.hpp"
#include "tests/fusion/cloud/octree_bytes.hpp"
#include "tests/long_run.hpp"
#include "tests/server/tick/graded_log.hpp"
#include "tests/tools/mutation_samples.hpp"
#include "tools/export/export_mcap.hpp"
#include "tools/map/scan_guess.hpp"
#include "tools/map/scan_sources.hpp"
#include "tools/slam/slam_log.hpp"
#include "tools/topic_text.hpp"

namespace parhelion::tools {
namespace {

using test::MutationSample;
using test::status_of;
using test::TemporaryFolder;

/// FNV-1a: the same damage whatever readers are added.
std::uint64_t seed_of(std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

}  // namespace

// 200 files for each reader, 5,000 in the long form.
TEST_P(MutatedFiles, AreAcceptedOrRefusedWithAMessage) {
  const MutatedReader& reader = GetParam();
  const TemporaryFolder folder;
  const MutationSample sample = reader.sample(folder);
  const Status undamaged = sample.read();
  ASSERT_TRUE(undamaged.ok()) << undamaged.error().message;
  const std::size_t files = (test::long_run() ? 5000 : 200) / reader.part;
  const auto result = test::read_mutated(sample, seed_of(reader.name), files);
  std::printf("| %s | %zu | %zu | %zu | %.2f s | %zu |\n", reader.name, result.files, result.accepted,
              result.refused, result.worst, result.deaths.size());
  for (const std::string& death : result.deaths) ADD_FAILURE() << reader.name << ", " << death;
  EXPECT_GT(result.refused, 0U) << "the damage has no effect";
}

namespace {

Status echo_all(const std::string& path) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  Status worst;
  for (;;) {
    const auto next = reader->next();
    if (!next) {
      worst = next.error();
      continue;
    }
    if (!*next) return worst;
    (void)echo_text(**next);
  }
}

Status play_all(const std::string& path) {
  auto recording = runtime::Recording::open(path);
  if (!recording) return recording.error();
  runtime::Player player(std::move(*recording), {}, [](const Message&) {});
  for (WallTime now{1}; !player.state().ended; now = now + seconds(0.1)) {
    const auto idle = player.turn(now);
    if (!idle) return idle.error();
  }
  return {};
}

Status replay_log(const std::string& path) {
  runtime::ReplayOptions options;
  options.log = path;
  options.threads = 1;
  return status_of(runtime::replay(options));
}

Status export_log(const std::string& path, const std::string& output) {
  ExportOptions options;
  options.log = path;
  options.output = output;
  options.overwrite = options.raw = true;
  return status_of(export_mcap(options));
}

Status slam(const std::string& path) {
  SlamLogOptions options;
  options.input = path;
  return status_of(map_log(options));
}

/// A session of 3 s, with two tasks.
MutationSample session(const TemporaryFolder& folder, Status (*read)(const std::string&)) {
  const std::string path = folder / "session.lcm";
  test::write_log(path, test::lesson(1, 2, true));
  return {{path}, [=] { return read(path); }};
}

/// A recording of 1 s: laser, odometry and poses.
MutationSample recording(const TemporaryFolder& folder, Status (*read)(const std::string&)) {
  const std::string path = folder / "recording.lcm";
  test::write_log(path, test::drive(1));
  return {{path}, [=] { return read(path); }};
}

MutationSample guess_sample(const TemporaryFolder& folder) {
  const std::string path = folder / "guess.txt";
  test::write_text(path, "# poses\n0 0 0 0\n1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1\n");
  return {{path}, [path] {
            std::vector<cloud::ScanToRegister> scans(2);
            return apply_guess(path, scans);
          }};
}

using F = const TemporaryFolder&;
const MutatedReader kReaders[] = {
    {"LCM log, topic echo", [](F f) { return recording(f, echo_all); }},
    {"LCM log, validate", [](F f) { return recording(f, validate); }},
    {"LCM log, slam", [](F f) { return recording(f, slam); }},
    {"LCM log, map register",
     [](F f) {
       std::vector<std::filesystem::path> files;
       const auto place = test::write_seven_scenes(f, files);
       const std::string log = f / "out.lcm";
       EXPECT_TRUE(import_recording(test::import_options(place, log), {}).ok());
       return MutationSample{{log}, [log] { return status_of(open_scans({log}, {}, {})); }};
     }},
    {"session log, grade",
     [](F f) {
       return session(f, [](const std::string& path) { return status_of(runtime::session_record(path)); });
     }},
    {"session log, play", [](F f) { return session(f, play_all); }},
    {"session log, validate", [](F f) { return session(f, validate); }},
    {"session log, report",
     [](F f) {
       return session(f, [](const std::string& path) { return status_of(review::review_session(path)); });
     }},
    {"session log, replay", [](F f) { return session(f, replay_log); }, 10},
    {"session log, MCAP export",
     [](F f) {
       MutationSample sample = session(f, nullptr);
       sample.read = [path = sample.files[0].string(), output = f / "out.mcap"] {
         return export_log(path, output);
       };
       return sample;
     }},
    {"rawlog, paired", [](F f) { return test::rawlog_sample(f, true, false); }},
    {"rawlog, observations", [](F f) { return test::rawlog_sample(f, false, false); }},
    {"rawlog, gzipped", [](F f) { return test::rawlog_sample(f, false, true); }},
    {"CARMEN log",
     [](F f) {
       test::write_text(f / "in.clf", test::carmen_text());
       return test::import_sample(f, "in.clf");
     }},
    {"CARMEN log, ROBOTLASER1",
     [](F f) {
       test::write_text(f / "in.clf", test::carmen_robotlaser_text());
       return test::import_sample(f, "in.clf");
     }},
    {"CARMEN log, gzipped",
     [](F f) {
       test::write_gzip(f / "in.clf.gz", test::carmen_text());
       return test::import_sample(f, "in.clf.gz");
     }},
    {"CARMEN log, bzip2",
     [](F f) {
       test::write_text(f / "in.clf.bz2", test::bzip2(test::carmen_text()));
       return test::import_sample(f, "in.clf.bz2");
     }},
    {"ROS bag",
     [](F f) {
       test::small_bag().write(f / "in.bag");
       return test::import_sample(f, "in.bag");
     }},
    {"ROS bag, bzip2",
     [](F f) {
       test::small_bag().write(f / "in.bag", "bz2", test::bzip2);
       return test::import_sample(f, "in.bag");
     }},
    {"ROS bag, LZ4",
     [](F f) {
       test::small_bag().write(f / "in.bag", "lz4", test::lz4);
       return test::import_sample(f, "in.bag");
     }},
    {"ROS 2 database",
     [](F f) {
       test::small_bag().write_database(f / "in.db3");
       return test::import_sample(f, "in.db3");
     }},
    {"MCAP",
     [](F f) {
       test::small_bag().write_mcap(f / "in.mcap", {McapCompression::none, 1U << 20U, ""});
       return test::import_sample(f, "in.mcap");
     }},
    {"MCAP, zstd",
     [](F f) {
       test::small_bag().write_mcap(f / "in.mcap", {McapCompression::zstd, 1U << 20U, ""});
       return test::import_sample(f, "in.mcap");
     }},
    {"RGB-D folder, 7-Scenes", test::seven_scenes_sample},
    {"RGB-D folder, TUM", test::tum_sample},
    {"simplemap", [](F f) { return test::simplemap_sample(f, false); }},
    {"simplemap, gzipped", [](F f) { return test::simplemap_sample(f, true); }},
    {"ROS map, YAML and PGM", test::ros_map_sample},
    {"PLY, binary", [](F f) { return test::written_cloud_sample(f, ".ply"); }},
    {"PLY, text", test::ply_text_sample},
    {"PCD, binary", [](F f) { return test::written_cloud_sample(f, ".pcd"); }},
    {"PCD, compressed", [](F f) { return test::pcd_sample(f, true); }},
    {"PCD, text", [](F f) { return test::pcd_sample(f, false); }},
    {"XYZ",
     [](F f) {
       test::write_text(f / "cloud.xyz", "x, y, z\n1, 2, 3\n\n# a remark\n-4,5.5,6\n0;0;-1\n");
       return test::cloud_sample(f / "cloud.xyz");
     }},
    {"3DTK scan and pose", test::uos_sample},
    {"LAS",
     [](F f) {
       test::write_text(f / "cloud.las", test::las(2, 3));
       return test::cloud_sample(f / "cloud.las");
     }},
    {"octree",
     [](F f) {
       using namespace test::octree;
       test::write_text(f / "cloud.bt", tree(7, node({{0, kOccupied}, {3, kOccupied}})));
       return test::cloud_sample(f / "cloud.bt");
     }},
    {"guessed poses", guess_sample},
};

INSTANTIATE_TEST_SUITE_P(Recordings, MutatedFiles, testing::ValuesIn(kReaders), reader_name);

}  // namespace
}  // namespace parhelion::tools

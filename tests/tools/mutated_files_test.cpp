// Every reader of files on damaged ones: it accepts them or gives an error with a message. It never crashes,
// and never takes more than 5 s of processor time or 1 GB.
#include <gtest/gtest.h>

#include <cstdio>

#include "protocols/authentication/keys.hpp"
#include "protocols/course.hpp"
#include "protocols/scenario.hpp"
#include "render/depth_image.hpp"
#include "render/jpeg.hpp"
#include "server/review/review.hpp"
#include "server/runtime/play/player.hpp"
#include "server/runtime/replay.hpp"
#include "server/runtime/session_record.hpp"
#include "server/simulation/robot_model.hpp"
#include "server/station/console/joystick_mapping.hpp"
#include "server/station/http/accounts.hpp"
#include "server/station/http/certificate.hpp"
#include "server/station/http/private_file.hpp"
#include "server/training/exchange.hpp"
#include "tests/long_run.hpp"
#include "tests/server/tick/graded_log.hpp"
#include "tests/server/training/exported_group.hpp"
#include "tests/tools/mutation_samples.hpp"
#include "tools/export/export_mcap.hpp"
#include "tools/import/image_files.hpp"
#include "tools/scan_guess.hpp"
#include "tools/scan_sources.hpp"
#include "tools/slam_log.hpp"
#include "tools/topic_text.hpp"
#include "tools/validate.hpp"

namespace parhelion::tools {
namespace {

using test::MutationSample;
using test::status_of;
using test::TemporaryFolder;

const std::filesystem::path kSource = PARHELION_SOURCE_DIR;

// ---- LCM logs
// -----------------------------------------------------------------------------------------------

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

Status validate(const std::string& path) {
  const Validation found = validate_file(path);
  return found.errors.empty() ? Status() : Status(Error{found.errors[0]});
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

// ---- YAML and URDF
// ------------------------------------------------------------------------------------------

MutationSample validated(const std::vector<std::filesystem::path>& files) {
  return {files, [path = files[0].string()] { return validate(path); }};
}

MutationSample copied(const TemporaryFolder& folder, const std::vector<std::string>& from) {
  std::vector<std::filesystem::path> files;
  for (const std::string& each : from) {
    files.emplace_back(folder / std::filesystem::path(each).filename().string());
    std::filesystem::copy_file(kSource / each, files.back());
  }
  return validated(files);
}

MutationSample course_sample(const TemporaryFolder& folder) {
  MutationSample scenario =
      copied(folder, {"server/scenarios/lanes/gaps.yaml", "server/scenarios/lanes/gaps_model.yaml"});
  test::write_text(
      folder / "course.yaml",
      "course: gaps\ntext: One lane.\nprogrammes:\n  - {scenario: gaps.yaml, text: Over them.}\n");
  return validated({folder / "course.yaml", scenario.files[0]});
}

MutationSample model_sample(const TemporaryFolder& folder) {
  SemanticModel model = test::room();
  ModelMesh mesh;
  mesh.name = "heap";
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 2, 3}};
  model.meshes = {mesh};
  test::write_text(folder / "model.yaml", to_yaml(model));
  return validated({folder / "model.yaml"});
}

MutationSample robot_sample(const TemporaryFolder& folder) {
  test::write_text(folder / "robot.yaml", to_yaml(test::robot()));
  return validated({folder / "robot.yaml"});
}

MutationSample keys_sample(const TemporaryFolder& folder) {
  Keys keys;
  keys.name = "server";
  keys.secret = new_secret();
  keys.senders = {{"rover", new_secret(), {"robot"}, {}}, {"anna", new_secret(), {"trainee"}, {"CHAT_.*"}}};
  const std::string path = folder / "keys.yaml";
  EXPECT_TRUE(station::write_private_file(path, to_yaml(keys)).ok());
  return {{path}, [path] { return status_of(load_keys(path)); }};
}

MutationSample joystick_sample(const TemporaryFolder& folder) {
  MutationSample sample = copied(folder, {"server/station/console/mappings/crawler.yaml"});
  sample.read = [path = sample.files[0].string()] { return status_of(station::load_joystick_mapping(path)); };
  return sample;
}

// ---- Pictures
// -----------------------------------------------------------------------------------------------

std::vector<std::uint8_t> octets_of(const std::filesystem::path& path) {
  const std::string bytes = test::bytes_of(path);
  return {bytes.begin(), bytes.end()};
}

MutationSample jpeg_sample(const TemporaryFolder& folder) {
  const std::string path = folder / "a.jpg";
  test::write_picture(path);
  return {{path}, [path] {
            std::vector<std::uint8_t> bgr;
            return status_of(render::JpegCodec().decode(octets_of(path), bgr));
          }};
}

Image depth_message(std::vector<std::uint8_t> bytes, const std::string& encoding) {
  Image image;
  image.width = 32, image.height = 24;
  image.format = PixelFormat::depth_mm;
  image.bytes = std::move(bytes);
  image.metadata = {{"encoding", {encoding.begin(), encoding.end()}}};
  return image;
}

MutationSample depth_sample(const TemporaryFolder& folder, const std::string& encoding) {
  const std::string path = folder / "depth";
  render::DepthPixels pixels{32, 24, std::vector<std::uint16_t>(768, 1500)};
  const auto image = render::encode_depth(pixels, depth_message({}, encoding));
  EXPECT_TRUE(image.ok());
  test::replace_file(path, {image->bytes.begin(), image->bytes.end()});
  return {{path}, [=] { return status_of(render::decode_depth(depth_message(octets_of(path), encoding))); }};
}

MutationSample imported_picture_sample(const TemporaryFolder& folder, bool depth) {
  test::write_picture(folder / "a.png");
  test::write_depth(folder / "d.png", 1000);
  const std::string path = folder / (depth ? "d.png" : "a.png");
  return {{path}, [=]() -> Status {
            const auto file = octets_of(path);
            if (depth) return status_of(read_depth_png(file, 1000));
            if (const auto grey = read_grey(file); !grey) return grey.error();
            return status_of(colour_image(file, {}));
          }};
}

// ---- Records, accounts, certificates
// --------------------------------------------------------------------------

Status read_records(const std::string& path) {
  for (const char* end : {"-wal", "-shm"}) std::filesystem::remove(path + end);
  auto records = training::Records::open(path, false, 100);
  if (!records) return records.error();
  const auto trainees = records->trainees();
  if (!trainees) return trainees.error();
  for (const auto& trainee : *trainees) {
    const auto sessions = records->sessions(trainee.pseudonym);
    if (!sessions) return sessions.error();
  }
  return {};
}

MutationSample records_sample(const TemporaryFolder& folder) {
  const std::string path = folder / "records.db";
  auto records = training::Records::open(path, true);
  EXPECT_TRUE(records.ok());
  EXPECT_TRUE(training::take(*records, {test::group(), 0}).ok());
  return {{path}, [path] { return read_records(path); }};
}

MutationSample history_sample(const TemporaryFolder& folder, const std::string& text) {
  const std::string path = folder / "history";
  test::write_text(path, text);
  return {{path}, [path] { return status_of(training::histories_from(test::bytes_of(path), path)); }};
}

MutationSample accounts_sample(const TemporaryFolder& folder) {
  const std::string path = folder / "accounts.json";
  auto accounts = station::Accounts::open(path);
  EXPECT_TRUE(accounts.ok() && (*accounts)->put_first("anna", "$argon2id$v=19$m=65536$aaaa").ok());
  return {{path}, [path] { return status_of(station::Accounts::open(path)); }};
}

MutationSample certificate_sample(const TemporaryFolder& folder) {
  const std::string path = folder / "cert.pem", key = folder / "key.pem";
  const WallTime now{1'700'000'000'000'000'000};
  EXPECT_TRUE(station::make_certificate(path, key, {"localhost"}, now).ok());
  return {{path, key}, [=]() -> Status {
            if (const Status made = station::make_certificate(path, key, {"localhost"}, now); !made)
              return made;
            return status_of(station::certificate_fingerprint(path));
          }};
}

MutationSample guess_sample(const TemporaryFolder& folder) {
  const std::string path = folder / "guess.txt";
  test::write_text(path, "# poses\n0 0 0 0\n1 0 0 0  0 1 0 0  0 0 1 0  0 0 0 1\n");
  return {{path}, [path] {
            std::vector<cloud::ScanToRegister> scans(2);
            return apply_guess(path, scans);
          }};
}

// ---- All of them
// --------------------------------------------------------------------------------------------

struct Reader {
  const char* name;
  std::function<MutationSample(const TemporaryFolder&)> sample;
  std::size_t part = 1;  ///< of the files: 10 means a tenth of them, for a reader that takes long
};

const std::vector<Reader>& readers() {
  using F = const TemporaryFolder&;
  static const std::vector<Reader> all = {
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
      {"guessed poses", guess_sample},
      {"scenario and model",
       [](F f) {
         return copied(f, {"server/scenarios/lanes/gaps.yaml", "server/scenarios/lanes/gaps_model.yaml"});
       }},
      {"course", course_sample},
      {"semantic model with a mesh", model_sample},
      {"robot description", robot_sample},
      {"robot model and URDF",
       [](F f) {
         return copied(f, {"server/robots/rover.yaml", "server/robots/rover.urdf"});
       }},
      {"laser preset", [](F f) { return copied(f, {"fusion/scan/presets/lms-200.yaml"}); }},
      {"joystick mapping", joystick_sample},
      {"keys", keys_sample},
      {"JPEG", jpeg_sample},
      {"depth image, PNG", [](F f) { return depth_sample(f, "png"); }},
      {"depth image, zlib", [](F f) { return depth_sample(f, "zlib"); }},
      {"imported picture, PNG", [](F f) { return imported_picture_sample(f, false); }},
      {"imported depth, PNG", [](F f) { return imported_picture_sample(f, true); }},
      {"records, SQLite", records_sample},
      {"records, JSON", [](F f) { return history_sample(f, training::to_json(test::group())); }},
      {"records, CSV", [](F f) { return history_sample(f, training::to_csv(test::group())); }},
      {"records, xAPI",
       [](F f) { return history_sample(f, training::to_xapi(test::group(), "https://a.invalid")); }},
      {"accounts", accounts_sample},
      {"certificate and key", certificate_sample},
  };
  return all;
}

/// FNV-1a: the same damage whatever readers are added.
std::uint64_t seed_of(std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  return hash;
}

class MutatedFiles : public testing::TestWithParam<std::size_t> {};

// 200 files for each reader, 5,000 in the long form.
TEST_P(MutatedFiles, AreAcceptedOrRefusedWithAMessage) {
  const Reader& reader = readers()[GetParam()];
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

INSTANTIATE_TEST_SUITE_P(Readers, MutatedFiles, testing::Range<std::size_t>(0, readers().size()),
                         [](const auto& chosen) {
                           std::string name = readers()[chosen.param].name;
                           std::erase_if(
                               name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
                           return name;
                         });

}  // namespace
}  // namespace parhelion::tools

// Damaged scenarios, models, keys, pictures, records and accounts; see mutated_files.hpp.
#include "protocols/authentication/keys.hpp"
#include "protocols/course.hpp"
#include "protocols/scenario.hpp"
#include "render/depth_image.hpp"
#include "render/jpeg.hpp"
#include "server/station/console/joystick_mapping.hpp"
#include "server/station/http/accounts.hpp"
#include "server/station/http/certificate.hpp"
#include "server/station/http/private_file.hpp"
#include "server/training/exchange.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/server/training/exported_group.hpp"
#include "tests/tools/mutated_files.hpp"
#include "tests/tools/mutation_samples.hpp"
#include "tools/import/image_files.hpp"

namespace parhelion::tools {
namespace {

using test::MutationSample;
using test::status_of;
using test::TemporaryFolder;

// ---- YAML and URDF
// ------------------------------------------------------------------------------------------

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

using F = const TemporaryFolder&;
const MutatedReader kSettingsReaders[] = {
    {"scenario and model",
     [](F f) {
       return copied(f, {"server/scenarios/lanes/gaps.yaml", "server/scenarios/lanes/gaps_model.yaml"});
     }},
    {"course", course_sample},
    {"semantic model with a mesh", model_sample},
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

INSTANTIATE_TEST_SUITE_P(Settings, MutatedFiles, testing::ValuesIn(kSettingsReaders), reader_name);

}  // namespace
}  // namespace parhelion::tools

// From a scan of a known building to a model, and a session with virtual robots in it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "fusion/cloud/write_cloud.hpp"
#include "fusion/pose/maps/grid_map.hpp"
#include "fusion/scan/ray_caster.hpp"
#include "fusion/semantic/build_model.hpp"
#include "render/compositor.hpp"
#include "server/runtime/replay.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/synthetic_site.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::tools {
namespace {

using ::testing::HasSubstr;

/// One model for all tests of this file, with the floor at zero, as the session requires.
const semantic::BuiltModel& built() {
  static const semantic::BuiltModel model = [] {
    semantic::ModelOptions options;
    options.floor_to_zero = true;
    auto made = semantic::build_model(test::scan_of_site(), options);
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return made ? std::move(*made) : semantic::BuiltModel{};
  }();
  return model;
}

TEST(MapModel, TheFloorIsAtZeroAndTheShiftIsRecorded) {
  const auto floor = semantic::ground_floor(built().model);
  ASSERT_TRUE(floor);
  EXPECT_NEAR(*floor, 0, 1e-9);
  EXPECT_NEAR(built().floor, -1.3, 0.02) << "in the cloud's own coordinates";
  EXPECT_NEAR((built().model.T_map_cloud * Eigen::Vector3d(0, 0, -1.3)).z(), 0, 0.02);
}

TEST(MapModel, LaserRangesInTheModelMatchTheBuilding) {
  const std::vector<float> time(360, 0.F);
  const scan::BeamSet beams{0.005F, 0.01745F, time};
  const auto T = Transform<Map, Laser>::planar(0.5, 0.3, 0, 0.4);
  // The model's map is the cloud's frame: its origin under the first scanner.
  std::vector<scan::RangeHit> site(360), model(360);
  scan::cast_building_exact({T, T}, beams, test::synthetic_site(), 30, site);
  scan::RayCaster caster;
  caster.set_building(built().model);
  caster.cast_building({T, T}, beams, 30, model);
  int alike = 0;
  for (std::size_t i = 0; i < site.size(); ++i) alike += std::abs(site[i].range - model[i].range) < 0.12F;
  EXPECT_GE(alike, 330) << "of 360; the rest pass through doorways and along edges";
}

TEST(MapModel, ModelYamlRoundTripsWithItsMesh) {
  const auto again = parse_model(to_yaml(built().model), "model.yaml");
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(to_yaml(*again), to_yaml(built().model));
  ASSERT_FALSE(again->meshes.empty());
  EXPECT_LE(again->meshes[0].triangles.size(), 50'000U);
}

/// Replays in the model with `agent`; returns all messages of the session.
std::vector<Message> replayed(AgentDefinition agent, const std::vector<Message>& log) {
  const test::TemporaryFolder folder;
  SemanticModel model = built().model;
  model.map_id = "synthetic";
  std::ofstream(folder / "model.yaml") << to_yaml(model);
  Scenario scenario;
  scenario.name = "in the model";
  scenario.model = folder / "model.yaml";
  scenario.agents = {std::move(agent)};
  std::ofstream(folder / "scenario.yaml") << to_yaml(scenario);
  test::write_log(folder / "drive.lcm", log);
  runtime::ReplayOptions options;
  options.log = folder / "drive.lcm";
  options.scenario = folder / "scenario.yaml";
  options.session = folder / "session.lcm";
  const auto report = runtime::replay(options);
  EXPECT_TRUE(report) << report.error().message;
  std::vector<Message> session;
  auto reader = LogReader::open(folder / "session.lcm");
  for (auto message = reader->next(); message && *message; message = reader->next())
    session.push_back(std::move(**message));
  return session;
}

/// The first obstacle that `rover` hits when it is driven straight ahead for 7 s.
std::optional<Event> first_collision(double x, double y, double yaw) {
  AgentDefinition rover = test::agent("rover", AgentKind::robot, x, y, BehaviourKind::teleop);
  rover.T_map_base = Transform<Map, Base>::planar(x, y, yaw);
  std::vector<Message> teleop;
  for (int i = 0; i < 140; ++i) {
    const std::int64_t utime = test::kStartUs + 500'000 + i * 50'000;
    teleop.push_back(test::message("MR_AGENT_rover_TELEOP", utime,
                                   TwistCommand{SensorTime::from_utime(utime), Twist2{0.4, 0, 0}}));
  }
  for (const Message& message : replayed(rover, test::drive(8, std::move(teleop)))) {
    Event event;
    if (message.channel != channel::kMrEvents) continue;
    if (!decode(channel::kMrEvents, message.payload, event)) continue;
    if (event.kind == EventKind::contact_started && event.subject == "rover") return event;
  }
  return std::nullopt;
}

TEST(MapModel, AModelWallStopsAnAgentInReplay) {
  const auto hit = first_collision(2.4, 1.2, std::numbers::pi / 2);
  ASSERT_TRUE(hit) << "the rover drove through the wall";
  EXPECT_THAT(hit->object, HasSubstr("wall"));
  EXPECT_NEAR(hit->position.y(), 2.5, 0.15);
}

TEST(MapModel, ACupboardStopsAnAgentInReplay) {
  const auto hit = first_collision(-1.2, -1.2, std::numbers::pi);
  ASSERT_TRUE(hit) << "the rover drove through the cupboard";
  EXPECT_EQ(hit->object, "cupboard 1");
  EXPECT_NEAR(hit->position.x(), -2.52, 0.15);
}

/// The synthetic drive of a robot with a camera, and the same image at each scan.
std::vector<Message> drive_with_camera(const Image& image) {
  RobotDescription robot = test::robot();
  CameraDescription camera;
  camera.intrinsics = {image.width, image.height, 130, 130, image.width / 2.0, image.height / 2.0, {}, {}};
  Eigen::Matrix3d R_base_optical;  // looks along the base's -y
  R_base_optical << -1, 0, 0, 0, 0, -1, 0, -1, 0;
  const Eigen::Quaterniond ahead(Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitZ()));
  camera.T_base_optical =
      Transform<Base, CameraOptical>(ahead * Eigen::Quaterniond(R_base_optical), {0, 0, 1.0});
  robot.camera = camera;
  std::vector<Message> images;
  for (int i = 5; i < 15; ++i) {
    const std::int64_t utime = test::kStartUs + i * 100'000;
    Image taken = image;
    taken.stamp = SensorTime::from_utime(utime);
    images.push_back(test::message(channel::kCamera, utime + 30'000, taken));
  }
  std::vector<Message> log = test::drive(2, std::move(images));
  for (Message& message : log) {
    if (message.channel == channel::kRobot)
      encode(RobotMessage{SensorTime::from_utime(test::kStartUs), to_yaml(robot)}, message.payload);
  }
  return log;
}

TEST(MapModel, ReplayVideoHidesAnAgentBehindAModelWall) {
  Image image;
  image.width = 160, image.height = 120, image.row_stride = 480;
  image.format = PixelFormat::bgr;
  image.bytes.assign(160 * 120 * 3, 120);
  const auto log = drive_with_camera(image);
  const auto frames_changed = [&](double x, double y) {
    std::size_t frames = 0, changed = 0;
    for (const Message& message : replayed(test::agent("barrel", AgentKind::barrel, x, y), log)) {
      if (message.channel != channel::kMrCamera) continue;
      Image out;
      EXPECT_TRUE(decode(channel::kMrCamera, message.payload, out).ok());
      ++frames;
      changed += out.bytes != image.bytes;
    }
    EXPECT_EQ(frames, 10U);
    return changed;
  };
  EXPECT_EQ(frames_changed(2.5, -0.5), 10U) << "before the middle wall";
  EXPECT_EQ(frames_changed(4.2, -1.7), 0U) << "behind it";
}

TEST(MapModel, AModelWallHidesAVirtualBody) {
  auto compositor = render::Compositor::create(built().model);
  ASSERT_TRUE(compositor) << compositor.error().message;
  render::RenderJob job;
  job.image.width = 320, job.image.height = 240, job.image.row_stride = 960;
  job.image.format = PixelFormat::bgr;
  job.image.bytes.assign(320 * 240 * 3, 120);
  CameraIntrinsics& c = job.camera.intrinsics;
  c.width = 320, c.height = 240, c.fx = c.fy = 250, c.cx = 160, c.cy = 120;
  Eigen::Matrix3d R;  // looks along +x
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  job.T_map_optical = Transform<Map, CameraOptical>(Eigen::Quaterniond(R), {0.5, -1.0, 1.0});
  const auto pixels_at = [&](double x) {
    auto scene = std::make_shared<Scene>();
    BodyDefinition body;
    body.id = 1;
    body.entity = "ghost";
    body.injectable = true;
    body.shapes.emplace_back();
    body.shapes[0].size = {0.5, 0.5, 1.2};
    scene->bodies = {std::make_shared<const BodyDefinition>(body)};
    job.world.scene = scene;
    BodyState state;
    state.id = 1;
    state.T_map_body = Transform<Map, Body>::planar(x, -1.0, 0, 0.9);
    job.world.bodies = {state};
    const auto pixels = (*compositor)->compose_pixels(job);
    EXPECT_TRUE(pixels) << pixels.error().message;
    return static_cast<std::size_t>(std::count(pixels->mask.begin(), pixels->mask.end(), 255));
  };
  EXPECT_GT(pixels_at(2.2), 1000U) << "before the middle wall";
  EXPECT_EQ(pixels_at(4.2), 0U) << "behind it";
}

class MapModelCommand : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
};

TEST_F(MapModelCommand, WritesAllRequestedOutputsAndKeepsCorrections) {
  ASSERT_TRUE(cloud::write_ply(folder_ / "site.ply", test::scan_of_site(0.012)).ok());
  const std::string base = std::string(PARHELION_BINARY_DIR) + "/tools/parhelion map model " +
                           (folder_ / "site.ply") + " -o " + (folder_ / "model.yaml");
  const std::string all = base + " --floor-to-zero --gltf " + (folder_ / "m.gltf") + " --picture " +
                          (folder_ / "m.png") + " --summary " + (folder_ / "s.json") + " --slice " +
                          (folder_ / "slice") + " --labelled " + (folder_ / "l.ply");
  ASSERT_EQ(std::system((all + " 2>/dev/null").c_str()), 0);
  for (const char* name : {"model.yaml", "m.gltf", "m.png", "s.json", "slice.yaml", "slice.pgm", "l.ply"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / name)) << name;
  std::ifstream file(folder_ / "s.json");
  const auto summary = nlohmann::json::parse(file);
  EXPECT_NEAR(summary["floor_m"].get<double>(), -1.3, 0.02)
      << "in the levelled cloud, not in the moved model";
  EXPECT_NEAR(summary["ceiling_m"].get<double>(), 1.3, 0.02);
  EXPECT_GE(summary["walls"].size(), 4U);
  const auto map = pose::load_ros_map(folder_ / "slice.yaml");
  ASSERT_TRUE(map) << map.error().message;
  auto model = load_model(folder_ / "model.yaml");
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->map_id, map->id);
  // A person deletes a wall and draws a pane of glass; a second run must keep this.
  for (ModelEntity& e : model->entities) {
    if (e.label != EntityLabel::wall) continue;
    e.deleted = true;
    break;
  }
  model->entities.push_back(test::model_box("glass", EntityLabel::wall, {1, 1, 1}, {1, 0.02, 2}));
  model->entities.back().is_virtual = true;
  std::ofstream(folder_ / "model.yaml") << to_yaml(*model);
  EXPECT_NE(std::system((base + " 2>/dev/null").c_str()), 0) << "nothing is overwritten unasked";
  ASSERT_EQ(std::system((base + " --floor-to-zero --force 2>/dev/null").c_str()), 0);
  const auto again = load_model(folder_ / "model.yaml");
  ASSERT_TRUE(again) << again.error().message;
  std::size_t deleted = 0, drawn = 0;
  for (const ModelEntity& e : again->entities)
    deleted += e.deleted, drawn += e.name == "glass" && e.is_virtual;
  EXPECT_EQ(deleted, 1U);
  EXPECT_EQ(drawn, 1U);
}

TEST(BuildModel, ReportsErrorsOfTheCloud) {
  EXPECT_THAT(semantic::build_model({}).error().message, HasSubstr("no points"));
  cloud::PointCloud<Cloud> millimetres = test::scan_of_site(0.03);
  for (Eigen::Vector3f& p : millimetres.points) p *= 1000;
  const auto built_in_mm = semantic::build_model(millimetres);
  ASSERT_FALSE(built_in_mm);
  EXPECT_THAT(built_in_mm.error().message, HasSubstr("--unit mm"));
}

TEST(BuildModel, DistantOutliersAreOmittedAndCounted) {
  cloud::PointCloud<Cloud> cloud = test::scan_of_site(0.02);
  for (const float far : {3e5F, -8e6F, 400.F}) {
    cloud.points.emplace_back(far, 0.5F * far, 1.F);
    cloud.scans.push_back(0);
  }
  const std::size_t points = cloud.size();
  const auto model = semantic::build_model(std::move(cloud));
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(model->cloud.size(), points - 3);
  EXPECT_EQ(model->cloud.scans.size(), points - 3);
  EXPECT_THAT(model->notes, ::testing::Contains(HasSubstr("3 points left out")));
}

}  // namespace
}  // namespace parhelion::tools

// The guide "Add a simulated robot": its two files define a robot that drives, and it names every key.
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>

#include "robots_world.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

std::string text_of(const std::string& path) {
  std::ifstream file(std::filesystem::path(PARHELION_SOURCE_DIR) / path);
  EXPECT_TRUE(file.is_open()) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string page() { return text_of("docs/add-a-robot.md"); }

/// The first code block of the page in that language.
std::string block(const std::string& language) {
  const std::string all = page(), open = "```" + language + "\n";
  const std::size_t begin = all.find(open), end = all.find("\n```", begin + open.size());
  EXPECT_NE(begin, std::string::npos) << language;
  return all.substr(begin + open.size(), end - begin - open.size() + 1);
}

TEST(AddARobotGuide, TheExampleOfThePageDrivesTurnsAndRaisesItsBar) {
  auto model = parse_robot_model(block("xml"), block("yaml"), "cart.yaml");
  ASSERT_TRUE(model.ok()) << model.error().message;
  SimulationOptions options;
  options.robot_models.push_back(std::make_shared<const RobotModel>(std::move(*model)));
  Simulation simulation = make(floor_of(20), options);
  spawn(simulation, articulated("r", "cart", 0, 0));
  drive(simulation, "r", {0.5, 0, 0}, 3);
  EXPECT_NEAR(motion(simulation, "r").velocity.x(), 0.5, 0.025);
  EXPECT_NEAR(motion(simulation, "r").T_map_base.translation().z(), 0, 0.01);
  EXPECT_GT(motion(simulation, "r").T_map_base.rotation()(2, 2), 0.999);
  drive(simulation, "r", {0, 0, 0.8}, 2);
  EXPECT_NEAR(motion(simulation, "r").rotation_rate.z(), 0.8, 0.08);
  Joints joints;
  joints.names = {"bar_joint"};
  joints.positions = {1.2};
  const Status status = simulation.joint_command("r", joints);
  ASSERT_TRUE(status.ok()) << status.error().message;
  run(simulation, 3);
  EXPECT_NEAR(motion(simulation, "r").joints.positions.at(0), 1.2, 0.01);
  EXPECT_EQ(count(simulation.take_events(), EventKind::joint_broken), 0U);
}

TEST(AddARobotGuide, TheDocumentationPageNamesEachKey) {
  const std::string all = page();
  std::size_t keys = 0;
  const auto expect_all = [&](const std::string& schema) {
    const std::string text = text_of("protocols/yaml/" + schema);
    const std::regex key("\"([a-z_]+)\": \\{");
    const std::string part = text.substr(text.find("\"properties\""));
    for (std::sregex_iterator each(part.begin(), part.end(), key), end; each != end; ++each) {
      const std::string name = (*each)[1];
      if (name == "properties" || name == "items" || name == "additionalProperties") continue;
      EXPECT_NE(all.find('`' + name + '`'), std::string::npos) << name << " of " << schema;
      ++keys;
    }
  };
  expect_all("robot_model.schema.json");
  EXPECT_GT(keys, 25U);
  for (const char* key :
       {"name", "laser", "line_laser", "camera", "depth", "imu", "footprint", "height", "mass", "limits",
        "velocity_frame", "command_type", "odometry_error_translation", "odometry_error_rotation", "source"})
    EXPECT_NE(all.find('`' + std::string(key) + '`'), std::string::npos) << key;
}

}  // namespace
}  // namespace parhelion::simulation

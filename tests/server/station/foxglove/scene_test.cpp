#include "server/station/foxglove/scene.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/station/foxglove/mesh_scene.hpp"
#include "tests/server/review/written_session.hpp"

namespace parhelion::station::foxglove {
namespace {

using nlohmann::json;

class WorldSceneTest : public ::testing::Test {
 protected:
  /// The names of entities that a message deletes.
  std::vector<std::string> deleted_in(const std::vector<std::string>& bodies) {
    WorldMessage world;
    world.stamp = SensorTime{1'000'000'000};
    for (const std::string& name : bodies) world.bodies.emplace_back().entity = name;
    JsonText text;
    scene_.write(world, shapes_, text);
    std::vector<std::string> names;
    const json update = json::parse(text.text());
    for (const json& deletion : update["deletions"]) names.push_back(deletion["id"]);
    return names;
  }

  const tick::Configuration configuration_ = test::WrittenSession().configuration();
  const simulation::EntityShapes shapes_{configuration_.scenario, configuration_.robot, configuration_.model,
                                         configuration_.robot_models};
  WorldScene scene_;
};

TEST_F(WorldSceneTest, AClientThatMissesAMessageStillReceivesDeletions) {
  EXPECT_TRUE(deleted_in({"barrel_1", "person_2"}).empty());
  for (int message = 0; message < 100; ++message)
    EXPECT_EQ(deleted_in({"person_2"}), std::vector<std::string>{"barrel_1"}) << message;
  EXPECT_TRUE(deleted_in({"person_2"}).empty());
}

TEST_F(WorldSceneTest, AReturningEntityIsNotDeletedAgain) {
  deleted_in({"barrel_1"});
  EXPECT_EQ(deleted_in({}), std::vector<std::string>{"barrel_1"});
  EXPECT_TRUE(deleted_in({"barrel_1"}).empty());
}

/// Of a session whose robot has a mesh of two triangles for its part "shell".
class MeshSceneTest : public ::testing::Test {
 protected:
  static simulation::EntityShapes shapes_with_mesh() {
    auto mesh = make_shape_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2}, {0, 2, 3}});
    EXPECT_TRUE(mesh.ok());
    auto model = std::make_shared<simulation::RobotModel>();
    model->name = "rover";
    simulation::RobotLink link;
    link.name = "shell";
    Shape shape{ShapeKind::mesh, mesh->size, {}, {}};
    shape.mesh = mesh->mesh;
    link.visible = {shape};
    model->links = {link};
    tick::Configuration configuration = test::WrittenSession().configuration();
    AgentDefinition rover;
    rover.name = "robot_1", rover.kind = AgentKind::robot, rover.model = "rover";
    configuration.scenario.agents = {rover};
    return {configuration.scenario, configuration.robot, configuration.model, {model}};
  }
  static WorldMessage world(std::vector<std::string> parts) {
    WorldMessage world;
    world.stamp = SensorTime{1'000'000'000};
    for (const std::string& part : parts) {
      WorldMessage::Entry& body = world.bodies.emplace_back();
      body.entity = "robot_1", body.part = part, body.kind = AgentKind::robot;
      body.T_map_body = Transform<Map, Body>::planar(1, 2, 0.5, 0);
    }
    return world;
  }

  const simulation::EntityShapes shapes_ = shapes_with_mesh();
  MeshScene scene_;
  JsonText text_;
};

TEST_F(MeshSceneTest, TrianglesAreWrittenOnceInAFrameThatMoves) {
  const WorldMessage there = world({"shell"});
  ASSERT_NE(shapes_.find("robot_1", "shell"), nullptr);
  EXPECT_TRUE(scene_.take(there, shapes_));
  scene_.write(there, shapes_, text_);
  const json update = json::parse(text_.text());
  ASSERT_EQ(update["entities"].size(), 1U);
  const json& entity = update["entities"][0];
  EXPECT_EQ(entity["id"], "robot_1/shell");
  EXPECT_EQ(entity["frame_id"], "robot_1/shell");
  EXPECT_EQ(entity["frame_locked"], true);
  EXPECT_EQ(entity["triangles"][0]["indices"].size(), 6U);
  EXPECT_EQ(entity["cubes"].size(), 0U);
  ASSERT_EQ(scene_.frames().size(), 1U);
  EXPECT_EQ(scene_.frames()[0].child, "robot_1/shell");
  EXPECT_NEAR(scene_.frames()[0].T_parent_child.translation().x(), 1, 1e-9);
  EXPECT_FALSE(scene_.take(there, shapes_)) << "nothing new";
}

TEST_F(MeshSceneTest, ABodyThatAppearsAgainIsWrittenAgain) {
  WorldMessage there = world({"shell"});
  scene_.take(there, shapes_);
  scene_.write(there, shapes_, text_);
  there.bodies.front().epoch = 1;
  EXPECT_TRUE(scene_.take(there, shapes_)) << "it may be another robot of that name";
}

TEST_F(MeshSceneTest, ABodyThatIsGoneIsDeleted) {
  const WorldMessage there = world({"shell"}), gone = world({});
  scene_.take(there, shapes_);
  scene_.write(there, shapes_, text_);
  EXPECT_TRUE(scene_.take(gone, shapes_));
  scene_.write(gone, shapes_, text_);
  const json update = json::parse(text_.text());
  EXPECT_EQ(update["deletions"][0]["id"], "robot_1/shell");
  EXPECT_TRUE(update["entities"].empty());
  EXPECT_FALSE(scene_.take(gone, shapes_));
}

}  // namespace
}  // namespace parhelion::station::foxglove

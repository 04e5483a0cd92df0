#include "server/station/foxglove/scene.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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

}  // namespace
}  // namespace parhelion::station::foxglove

#include "protocols/world.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace parhelion {
namespace {

WorldSnapshot world_of(const std::vector<BodyId>& definitions, const std::vector<BodyId>& states) {
  auto scene = std::make_shared<Scene>();
  for (const BodyId id : definitions) {
    auto body = std::make_shared<BodyDefinition>();
    body->id = id;
    body->entity = "body " + std::to_string(id);
    scene->bodies.push_back(std::move(body));
  }
  WorldSnapshot world;
  world.scene = scene;
  for (const BodyId id : states) world.bodies.emplace_back().id = id;
  return world;
}

std::vector<BodyId> visited(const WorldSnapshot& world) {
  std::vector<BodyId> ids;
  for_each_body(world, [&](const BodyDefinition& definition, const BodyState& state) {
    EXPECT_EQ(definition.id, state.id);
    EXPECT_EQ(definition.entity, "body " + std::to_string(state.id));
    ids.push_back(state.id);
  });
  return ids;
}

using Ids = std::vector<BodyId>;

TEST(World, EachBodyIsVisitedWithItsDefinition) {
  EXPECT_EQ(visited(world_of({1, 2, 5}, {1, 2, 5})), Ids({1, 2, 5}));
}

TEST(World, ABodyAbsentAtTheStampIsNotVisited) {
  EXPECT_EQ(visited(world_of({1, 2, 3, 4}, {2, 4})), Ids({2, 4}));
  EXPECT_EQ(visited(world_of({1, 2}, {})), Ids());
}

TEST(World, AStateWithoutADefinitionIsNotVisited) {
  EXPECT_EQ(visited(world_of({2, 4}, {1, 2, 3, 4, 5})), Ids({2, 4}));
  EXPECT_EQ(visited(world_of({}, {1})), Ids());
}

TEST(World, AWorldWithoutASceneHasNoBodiesToVisit) {
  WorldSnapshot world;
  world.bodies.emplace_back().id = 1;
  EXPECT_EQ(visited(world), Ids());
}

TEST(World, StatesOfANonConstWorldCanBeChanged) {
  WorldSnapshot world = world_of({1, 2}, {1, 2});
  for_each_body(world,
                [](const BodyDefinition& definition, BodyState& state) { state.epoch = 10 * definition.id; });
  EXPECT_EQ(world.bodies[1].epoch, 20U);
}

}  // namespace
}  // namespace parhelion

// Misspelt doors and targets in a scenario are refused at the start, with the name that was meant.
#include "server/tick/check_names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/model_box.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::tick {
namespace {

using testing::HasSubstr;

/// Two agents and a script in a room with a door; the second agent and the script have `target`.
Configuration with_target(const std::string& target) {
  Configuration configuration = test::configuration(
      {test::agent("guide", AgentKind::person, 4, 3), test::agent("visitor", AgentKind::person, 4, 2)});
  configuration.model.entities.push_back(
      test::model_box("door 2", EntityLabel::door, {1, 1, 1}, {1, 0.04, 2}));
  configuration.scenario.agents[1].behaviour.target = target;
  configuration.scenario.robot = "robot.yaml";
  return configuration;
}

Configuration with_door(const std::string& name) {
  Configuration configuration = with_target("");
  DoorSettings door;
  door.name = name;
  configuration.scenario.doors = {door};
  return configuration;
}

TEST(CheckNames, ADoorOfTheModelIsKnownAndNoOther) {
  EXPECT_TRUE(check_names(with_door("door 2")));
  const Status wrong = check_names(with_door("dor 2"));
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("scenario door 'dor 2': the model has no door of this name"));
  EXPECT_THAT(wrong.error().message, HasSubstr("did you mean 'door 2'?"));
}

TEST(CheckNames, ADeletedDoorIsNone) {
  Configuration configuration = with_door("door 2");
  configuration.model.entities.back().deleted = true;
  EXPECT_FALSE(check_names(configuration));
}

TEST(CheckNames, ATargetIsARobotOrAnAgent) {
  for (const std::string target : {"", "guide"}) EXPECT_TRUE(check_names(with_target(target))) << target;
  EXPECT_TRUE(check_names(with_target(with_target("").robot.name)));
  const Status wrong = check_names(with_target("giude"));
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("scenario agent 'visitor': its target 'giude' is no robot"));
  EXPECT_THAT(wrong.error().message, HasSubstr("did you mean 'guide'?"));
}

TEST(CheckNames, ARobotThatIsDescribedOnTheBusMayHaveAnyName) {
  Configuration configuration = with_target("rover_7");
  EXPECT_FALSE(check_names(configuration));
  configuration.scenario.robot.clear();
  EXPECT_TRUE(check_names(configuration));
}

TEST(CheckNames, AnAgentThatAScriptSpawnsIsATarget) {
  Configuration configuration = with_target("late");
  EXPECT_FALSE(check_names(configuration));
  Script script;
  script.name = "arrival";
  script.actions = {AgentSpawn{.agent = test::agent("late", AgentKind::person, 3, 3)}};
  configuration.scenario.scripts = {script};
  EXPECT_TRUE(check_names(configuration));
}

TEST(CheckNames, TheTargetsOfScriptsAreCheckedToo) {
  Configuration configuration = with_target("");
  AgentBehaviour behave;
  behave.agent = "guide";
  behave.behaviour.kind = BehaviourKind::follow;
  behave.behaviour.target = "visitr";
  Script script;
  script.name = "chase";
  script.actions = {behave};
  configuration.scenario.scripts = {script};
  const Status wrong = check_names(configuration);
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().message, HasSubstr("script 'chase': its target 'visitr'"));
}

}  // namespace
}  // namespace parhelion::tick

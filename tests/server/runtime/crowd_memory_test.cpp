// Ten thousand agents on a small machine.
#include "server/runtime/crowd_memory.hpp"

#include <gmock/gmock.h>

#include "server/runtime/session_state.hpp"
#include "server/simulation/simulation.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::runtime {
namespace {

using testing::HasSubstr;

constexpr std::uint64_t kGigabyte = 1'000'000'000;

Scenario crowd(std::size_t persons) {
  Scenario scenario;
  scenario.max_agents = std::max<std::uint64_t>(1000, persons);
  for (std::size_t i = 0; i < persons; ++i) {
    AgentDefinition person;
    person.name = "person_" + std::to_string(i);
    person.kind = AgentKind::person;
    scenario.agents.push_back(person);
  }
  return scenario;
}

TEST(CrowdMemory, RefusesTooManyAgentsAndReportsHowManyFit) {
  const Status status = check_crowd(crowd(10'000), 4 * kGigabyte);
  ASSERT_FALSE(status.ok());
  const std::string& text = status.error().message;
  EXPECT_THAT(text, HasSubstr("10000 agents"));
  EXPECT_THAT(text, HasSubstr("90000 bodies"));
  EXPECT_THAT(text, HasSubstr("4.0 GB free"));
  const auto at = text.find("at most ");
  ASSERT_NE(at, std::string::npos) << text;
  const std::uint64_t fit = std::stoull(text.substr(at + 8));
  EXPECT_GT(fit, 1000U);
  EXPECT_LT(fit, 10'000U);
  Scenario fewer = crowd(fit);
  EXPECT_TRUE(check_crowd(fewer, 4 * kGigabyte).ok());
}

TEST(CrowdMemory, MemoryForLaterSpawnsIsChecked) {
  Scenario scenario;
  scenario.max_agents = 10'000;
  EXPECT_FALSE(check_crowd(scenario, 4 * kGigabyte).ok());
  EXPECT_TRUE(check_crowd(scenario, 64 * kGigabyte).ok());
  EXPECT_TRUE(check_crowd(Scenario{}, kGigabyte / 10).ok()) << "the default asks for nothing";
}

TEST(CrowdMemory, AServerThatExceedsMemoryIsNotStarted) {
  auto configuration = test::configuration({});
  configuration.scenario.max_agents = 1'000'000'000;
  const auto state = make_session_state(configuration, ArrivalTime{});
  ASSERT_FALSE(state.ok());
  EXPECT_THAT(state.error().message, HasSubstr("1000000000 agents"));
}

TEST(CrowdMemory, TheEstimateIsCloseToTheMemoryOfTheStates) {
  const std::uint64_t states = 481 * sizeof(BodyState) * 9;
  EXPECT_GE(memory_of_bodies(9, 240), states);
  EXPECT_LE(memory_of_bodies(9, 240), states * 5 / 4);
}

}  // namespace
}  // namespace parhelion::runtime

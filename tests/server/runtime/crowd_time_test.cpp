// A crowd that a machine cannot simulate in real time.
#include "server/runtime/crowd_time.hpp"

#include <gmock/gmock.h>

#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {
namespace {

using testing::HasSubstr;

std::vector<AgentDefinition> persons(int count) {
  std::vector<AgentDefinition> all;
  for (int i = 0; i < count; ++i)
    all.push_back(test::agent("person_" + std::to_string(i), AgentKind::person, -4 + 0.8 * (i % 10),
                              -3 + 0.8 * (i / 10), BehaviourKind::wander));
  return all;
}

std::size_t number_after(const std::string& text, const std::string& words) {
  const auto at = text.find(words);
  return at == std::string::npos ? 0 : std::stoul(text.substr(at + words.size()));
}

TEST(CrowdTime, TheWarningNamesStepTimeAndHowManyAgentsFit) {
  Scenario scenario;
  scenario.max_agents = 10'000;
  const auto warning = slow_crowd(scenario, {500, 0.5e-3});
  ASSERT_TRUE(warning);
  EXPECT_THAT(*warning, HasSubstr("10000 agents is expected to take at least 10 ms"));
  EXPECT_THAT(*warning, HasSubstr("4.2 ms are available"));
  const std::size_t fit = number_after(*warning, "at most "),
                    rate = number_after(*warning, "physics_rate of ");
  scenario.max_agents = fit;
  EXPECT_FALSE(slow_crowd(scenario, {500, 0.5e-3})) << fit;
  scenario.max_agents = fit + fit / 100;
  EXPECT_TRUE(slow_crowd(scenario, {500, 0.5e-3})) << fit;
  scenario.max_agents = 10'000;
  scenario.physics_rate = static_cast<double>(rate);
  EXPECT_FALSE(slow_crowd(scenario, {500, 0.5e-3})) << rate;
}

TEST(CrowdTime, AgentsOfTheScenarioAreCounted) {
  Scenario scenario;
  scenario.agents = persons(100);
  EXPECT_FALSE(slow_crowd(scenario, {50, 1e-3})) << "max_agents is the default";
  EXPECT_TRUE(slow_crowd(scenario, {50, 2e-3}));
}

TEST(CrowdTime, StepTimeIsMeasuredOnPartOfTheCrowd) {
  const auto configuration = test::configuration(persons(60));
  const auto some = time_crowd(configuration, 20), all = time_crowd(configuration, 1000);
  ASSERT_TRUE(some && all);
  EXPECT_EQ(some->agents, 20U);
  EXPECT_EQ(all->agents, 60U);
  EXPECT_GT(some->seconds, 0);
  EXPECT_FALSE(time_crowd(test::configuration({}), 20)) << "there is none";
  EXPECT_FALSE(warn_of_slow_crowd(configuration)) << "small crowds are not tried";
}

}  // namespace
}  // namespace parhelion::runtime

// Agents without possible contacts are moved outside the solver: with equal results, and without lost events.
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

SimulationOptions with(bool solve_all) {
  SimulationOptions options;
  options.solve_all = solve_all;
  options.zones = {{"yard", {{-3, -3}, {3, -3}, {3, 3}, {-3, 3}}},
                   {"corner", {{4, 4}, {9, 4}, {9, 9}, {4, 9}}}};
  return options;
}

struct RunResult {
  std::vector<Event> events;
  std::vector<BodyState> bodies;
  std::size_t unconstrained_steps = 0;  ///< number of unconstrained agents, summed over the steps
};

/// `agents` for `duration` s, with the real robot at `real(s)`.
template <class Real>
RunResult simulate(const std::vector<AgentDefinition>& agents, double duration, bool solve_all, Real real) {
  Simulation simulation = make(room(24), with(solve_all));
  for (const AgentDefinition& each : agents) spawn(simulation, each);
  RunResult result;
  std::vector<LaserRequest> requests;
  for (int i = 0; i < std::lround(duration * 240); ++i) {
    simulation.step(real(i / 240.0), requests);
    result.unconstrained_steps += simulation.unconstrained_agents();
  }
  result.events = simulation.take_events();
  WorldSnapshot world;
  EXPECT_TRUE(simulation.at(simulation.now(), world));
  result.bodies = world.bodies;
  return result;
}

template <class Real>
RunResult expect_same_runs(const std::vector<AgentDefinition>& agents, double duration, Real real,
                           double within) {
  const RunResult solved = simulate(agents, duration, true, real),
                  result = simulate(agents, duration, false, real);
  EXPECT_EQ(solved.unconstrained_steps, 0U);
  EXPECT_EQ(result.events.size(), solved.events.size());
  for (std::size_t i = 0; i < std::min(result.events.size(), solved.events.size()); ++i) {
    const Event &a = result.events[i], &b = solved.events[i];
    EXPECT_EQ(a.kind, b.kind) << i;
    EXPECT_EQ(a.subject, b.subject) << i;
    EXPECT_EQ(a.object, b.object) << i;
    EXPECT_NEAR((a.stamp - b.stamp).seconds(), 0, 1.0 / 240 + 1e-9) << i << ", " << to_string(a.kind);
  }
  for (std::size_t i = 0; i < result.bodies.size(); ++i) {
    const auto &a = result.bodies[i], &b = solved.bodies[i];
    EXPECT_LT((a.T_map_body.isometry().matrix() - b.T_map_body.isometry().matrix()).norm(), within) << i;
    EXPECT_LT((a.velocity - b.velocity).norm(), 100 * within) << i;
  }
  return result;
}

const auto kNobody = [](double) { return std::optional<RealRobotState>(); };

TEST(UnconstrainedMotion, UndisturbedAgentsMoveAndReportIdentically) {
  AgentDefinition patrol = moving("patrol", AgentKind::robot, 6, -8, BehaviourKind::patrol);
  patrol.behaviour.waypoints = {{6, -8}, {-6, -8}};
  const std::vector<AgentDefinition> agents{
      moving("walker", AgentKind::person, 0, 0, BehaviourKind::wander, 1.0),
      moving("rover", AgentKind::robot, 6, 6, BehaviourKind::wander), patrol,
      agent("crate", AgentKind::box, -8, 8), agent("stander", AgentKind::person, -8, 0)};
  const RunResult result = expect_same_runs(agents, 40, kNobody, 1e-6);
  EXPECT_GT(result.unconstrained_steps,
            40U * 240);  // one of the five on average; otherwise the test shows nothing
  EXPECT_GT(count(result.events, EventKind::zone_entered), 0U);
  EXPECT_GT(count(result.events, EventKind::zone_left), 0U);
  EXPECT_GT(count(result.events, EventKind::movement_started), 2U);
}

TEST(UnconstrainedMotion, AgentsReturnToTheSolverBeforeRealRobotContact) {
  const auto drives = [](double t) {
    return std::optional(real_at(-6 + 2.5 * t, 0.05, 0, {t < 4 ? 2.5 : 0, 0, 0}));
  };
  // The solver's warm start before a contact changes the sixth digit.
  const RunResult result = expect_same_runs({agent("stander", AgentKind::person, 0, 0)}, 3.5, drives, 1e-4);
  EXPECT_GT(result.unconstrained_steps, 240U);
  EXPECT_EQ(count(result.events, EventKind::contact_started), 1U);
  EXPECT_EQ(count(result.events, EventKind::movement_started), 2U) << "it was pushed";
}

TEST(UnconstrainedMotion, AnAppearingRealRobotPushesAStandingAgent) {
  const auto appears = [](double t) {
    if (t < 1) return std::optional<RealRobotState>();
    std::optional<RealRobotState> real = real_at(-0.65 + (t - 1), 0, 0, {1, 0, 0});
    real->injection_live = false;  // otherwise the stander would be moved away
    return real;
  };
  const RunResult result = expect_same_runs({agent("stander", AgentKind::person, 0, 0)}, 2.5, appears, 1e-4);
  EXPECT_GT(result.unconstrained_steps, 100U);
  EXPECT_EQ(count(result.events, EventKind::contact_started), 1U);
}

}  // namespace
}  // namespace parhelion::simulation

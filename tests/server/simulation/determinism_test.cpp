// Promise 4 for the physics: the same calls give the same states, bit for bit.
#include <cstring>

#include "protocols/hash.hpp"
#include "tests/allocations.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

std::uint64_t hash_bytes(std::uint64_t hash, const void* bytes, std::size_t size) {
  const auto* at = static_cast<const unsigned char*>(bytes);
  for (std::size_t i = 0; i < size; ++i) hash = fnv1a(at[i], hash);
  return hash;
}

RealRobotState driven_trace(int i) {
  return real_at(-3 + 0.4 * i / 240, 0.2 * std::sin(0.01 * i), 0, {0.4, 0, 0});
}

/// The `i`th robot and the `i`th person.
void spawn_wandering_pair(Simulation& simulation, int i) {
  const std::string number = std::to_string(i);
  const double x = -3 + 2 * i;
  spawn(simulation, moving("robot" + number, AgentKind::robot, x, 3, BehaviourKind::wander));
  spawn(simulation, moving("person" + number, AgentKind::person, x, -3, BehaviourKind::wander));
}

Simulation crowded() {
  Simulation simulation = make(room(10));
  for (int i = 0; i < 4; ++i) spawn_wandering_pair(simulation, i);
  for (int i = 0; i < 5; ++i) {
    AgentDefinition crate = agent("crate" + std::to_string(i), AgentKind::box, -1 + 0.45 * i, 0.1 * i);
    crate.size = {0.3, 0.3, 0.5 + 0.2 * i};
    spawn(simulation, crate);
    spawn(simulation, agent("barrel" + std::to_string(i), AgentKind::barrel, -1 + 0.45 * i, -1));
  }
  return simulation;
}

/// Hash of all states in ten simulated seconds in which crates are run over and agents are spawned and
/// removed.
std::uint64_t hash_of_states() {
  Simulation simulation = crowded();
  std::uint64_t hash = kFnvBasis;
  std::vector<LaserRequest> requests;
  WorldSnapshot world;
  for (int i = 0; i < 2400; ++i) {
    if (i == 1000) {
      EXPECT_TRUE(simulation.command(AgentRemove{.agent = "crate3"}, driven_trace(i)).ok());
    }
    for (double y = -4.2; i == 1200 && y < 4.3; y += 0.5) {  // the first position where nobody walks
      if (simulation.spawn(agent("late", AgentKind::barrel, 4, y), driven_trace(i)).ok()) break;
    }
    simulation.step(driven_trace(i), requests);
    EXPECT_TRUE(simulation.at(simulation.now(), world));
    for (const BodyState& state : world.bodies) {
      hash = hash_bytes(hash, state.T_map_body.isometry().matrix().data(), 12 * sizeof(double));
      hash = hash_bytes(hash, state.velocity.data(), 3 * sizeof(double));
    }
  }
  return hash;
}

TEST(Determinism, TwoRunsGiveTheSameStatesBitForBit) {
  const std::uint64_t first = hash_of_states();
  EXPECT_EQ(first, hash_of_states());
  // Observed in debug and release builds of Debian 12 (Bullet 3.24, glibc 2.36). Other versions may differ;
  // so does a CPU without FMA, for which glibc computes other sines.
  EXPECT_TRUE(first == 0x6e0dbf2a168b1c81ULL || !__builtin_cpu_supports("fma")) << std::hex << first;
}

TEST(Determinism, AnotherSeedGivesAnotherWalk) {
  const auto place = [](std::uint64_t seed) {
    SimulationOptions options;
    options.seed = seed;
    Simulation simulation = make(room(20), options);
    spawn(simulation, moving("walker", AgentKind::person, 0, 0, BehaviourKind::wander));
    run(simulation, 5);
    return body(simulation, "walker").T_map_body.translation();
  };
  EXPECT_GT((place(1) - place(2)).norm(), 0.1);
  EXPECT_EQ((place(1) - place(1)).norm(), 0);
}

TEST(Determinism, SteppingAndQueryingAllocateNothingAfterWarmUp) {
  Simulation simulation = make(room(10));
  for (int i = 0; i < 4; ++i) {
    spawn_wandering_pair(simulation, i);
    spawn(simulation, agent("crate" + std::to_string(i), AgentKind::box, -3 + 2 * i, 0));
  }
  const RealRobotState real = real_at(0, 1.5);
  run(simulation, 20, real);
  WorldSnapshot world;
  std::vector<LaserRequest> requests;
  ASSERT_TRUE(simulation.at(simulation.now() - milliseconds(3), world));
  simulation.take_events();
  simulation.clearance(real.T_map_base, {0.5, 0, 0.2}, 2);
  // Bullet allocates with malloc, so only our own code is counted.
  std::size_t allocated = 0, quiet = 0;
  for (int i = 0; i < 1200; ++i) {
    const test::AllocationWatch watch;
    simulation.step(real, requests);
    simulation.at(simulation.now() - milliseconds(3), world);
    simulation.clearance(real.T_map_base, {0.5, 0, 0.2}, 2);
    const std::size_t count = watch.count();
    if (!simulation.take_events().empty()) continue;  // events do allocate
    allocated += count;
    ++quiet;
  }
  EXPECT_EQ(allocated, 0U);
  EXPECT_GT(quiet, 1000U);
}

}  // namespace
}  // namespace parhelion::simulation

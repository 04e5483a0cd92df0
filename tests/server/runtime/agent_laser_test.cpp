// An agent's laser scan is the same as with every body of the world cast by one thread, not only the visible
// ones.
#include <gmock/gmock.h>

#include "server/runtime/thread_pool.hpp"
#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/robots/base_body.hpp"
#include "server/tick/bodies_in_sweep.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::runtime {
namespace {

class AgentLaser : public test::TickTest {
 protected:
  /// The scan of `agent` at `end`, the `sequence`-th of the session, cast with all bodies.
  std::vector<std::uint8_t> with_all_bodies(const std::string& agent, SimulationTime end,
                                            std::uint64_t sequence) {
    LaserDescription laser = *load_laser_preset("lms-200");
    laser.T_base_laser = simulation::agent_laser_mount();
    std::vector<float> time;
    const scan::Sweep sweep = scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
    WorldSnapshot first, last;
    EXPECT_TRUE(state_->simulation.at(end, last));
    if (!state_->simulation.at(end - (sweep.end - sweep.start), first)) first = last;
    BodyId own = 0;
    for (auto each = last.scene->bodies.rbegin(); each != last.scene->bodies.rend(); ++each) {
      if ((*each)->entity == agent) own = (*each)->id;
    }
    std::vector<scan::BodyMotion> motions;
    tick::bodies_in_sweep(first, last, motions, [&](const BodyDefinition& body, const BodyState&) {
      return body.entity != agent && tick::is_cast_as_body(body);
    });
    scan::LaserMotion motion;
    const auto mounted = [&](const WorldSnapshot& world) {
      const auto at = std::find_if(world.bodies.begin(), world.bodies.end(),
                                   [&](const BodyState& body) { return body.id == own; });
      return simulation::base_of(at->T_map_body) * laser.T_base_laser;
    };
    motion.T_map_laser_start = mounted(first);
    motion.T_map_laser_end = mounted(last);
    const scan::BeamSet beams{static_cast<float>(laser.angle_min), static_cast<float>(laser.angle_increment),
                              time};
    std::vector<scan::RangeHit> bodies(time.size()), building(time.size());
    scan::RayCaster caster;
    caster.set_building(scan::BuildingTree(configuration_.model, scan::BuildingTree::Doors::left_out));
    caster.cast_bodies(motion, beams, motions, laser.convention.range_max, bodies);
    caster.cast_building(motion, beams, laser.convention.range_max, building);
    Scan scan;
    scan::simulate_scan(laser, {configuration_.scenario.seed, (std::uint64_t{own} + 1) << 32 | sequence},
                        bodies, building, {end.ns - sweep.end.ns}, scan);
    std::vector<std::uint8_t> payload;
    encode(scan, payload);
    return payload;
  }
};

tick::Configuration scene_with_lasers() {
  auto scene = test::configuration({test::agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                                    test::agent("robot_2", AgentKind::robot, -3, 2, BehaviourKind::wander),
                                    test::agent("person_1", AgentKind::person, -3, -1, BehaviourKind::wander),
                                    test::agent("person_2", AgentKind::person, 2, 3, BehaviourKind::wander),
                                    test::agent("low", AgentKind::box, 0, 0),
                                    test::agent("barrel", AgentKind::barrel, 0.6, -0.4)});
  scene.scenario.agents[0].laser = scene.scenario.agents[1].laser = "lms-200";
  scene.scenario.agents[4].size = {0.4, 0.4, 0.29};  // its top is a centimetre below the laser's plane
  return scene;
}

TEST_F(AgentLaser, EqualsCastingEveryBody) {
  start(scene_with_lasers());
  std::uint64_t sequence = 0;
  std::size_t compared = 0;
  for (const Message& input : test::drive(2)) {
    feed(input);
    // The message does not identify the requesting step: the scan's stamp is its sweep's start.
    std::vector<const tick::Outputs::Entry*> scans;
    for (const tick::Outputs::Entry& entry : outputs_.entries()) {
      if (entry.channel.starts_with("MR_AGENT_")) scans.push_back(&entry);
    }
    for (const tick::Outputs::Entry* entry : scans) {
      ++sequence;
      Scan scan;
      ASSERT_TRUE(decode(entry->channel, entry->payload, scan).ok());
      const LaserDescription laser = *load_laser_preset("lms-200");
      std::vector<float> time;
      const scan::Sweep sweep = scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
      // Stamps have microseconds on the wire; use the nearest step's instant.
      const double rate = configuration_.scenario.physics_rate;
      const SimulationTime began = simulation_time(ArrivalTime::from_utime(test::kStartUs - 2000));
      const double since = (SimulationTime{scan.stamp.ns + sweep.end.ns} - began).seconds();
      const SimulationTime end = began + seconds(std::round(since * rate) / rate);
      const std::string agent = entry->channel.substr(9, entry->channel.size() - 9 - 5);
      EXPECT_EQ(entry->payload, with_all_bodies(agent, end, sequence)) << agent << ", scan " << sequence;
      ++compared;
    }
  }
  EXPECT_GT(compared, 100U);
}

TEST_F(AgentLaser, ResultIsTheSameForAnyNumberOfThreads) {
  const auto all = [&](int threads) {
    configuration_ = scene_with_lasers();
    state_ = *tick::make_state(configuration_, ArrivalTime::from_utime(test::kStartUs - 2000),
                               std::make_unique<ThreadPool>(threads));
    out_.clear();
    feed(test::drive(3));
    return out_;
  };
  const auto one = all(1);
  EXPECT_GT(one.at("MR_AGENT_robot_1_SCAN").size(), 20U);
  EXPECT_TRUE(all(2) == one);
  EXPECT_TRUE(all(8) == one);
}

}  // namespace
}  // namespace parhelion::runtime

#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

std::vector<Event> drive_into(Simulation& simulation, double from, double to, double speed, double sigma) {
  std::vector<LaserRequest> requests;
  const int steps = static_cast<int>(std::abs(to - from) / speed * 240);
  for (int i = 0; i <= steps; ++i) {
    RealRobotState real = real_at(from + (to - from) * i / steps, 0, 0, {to > from ? speed : -speed, 0, 0});
    real.sigma = sigma;
    simulation.step(real, requests);
  }
  std::vector<Event> events = simulation.take_events();
  std::erase_if(events, [](const Event& event) {
    return event.kind == EventKind::movement_started || event.kind == EventKind::collision_predicted;
  });
  return events;
}

TEST(RealContacts, HittingAModelledWallReportsMassTimesClosingSpeed) {
  Simulation simulation = make(room(6));
  auto events = drive_into(simulation, 0, 2.76, 0.5, 0.01);
  ASSERT_EQ(count(events, EventKind::contact_started), 1U);
  EXPECT_EQ(events[0].subject, "pioneer");
  EXPECT_EQ(events[0].object, "wall 1");
  EXPECT_EQ(events[0].pair, PairKind::real_real);
  EXPECT_NEAR(events[0].impulse, 40 * 0.5, 0.5);
  EXPECT_NEAR(events[0].position.x(), 3, 1e-6);
  EXPECT_LT(std::abs(events[0].position.y()), 0.21);
  events = drive_into(simulation, 2.76, 1, 0.5, 0.01);
  EXPECT_EQ(count(events, EventKind::contact_ended), 1U);
}

TEST(RealContacts, TheMarginIsThePosesUncertainty) {
  for (const double sigma : {0.005, 0.05}) {
    Simulation simulation = make(room(6));
    const auto events = drive_into(simulation, 0, 2.72, 0.3, sigma);  // 3 cm from the wall
    EXPECT_EQ(count(events, EventKind::contact_started), sigma > 0.03 ? 1U : 0U) << sigma;
  }
}

TEST(RealContacts, PassingAlongAWallIsNoContact) {
  Simulation simulation = make(room(6));
  std::vector<LaserRequest> requests;
  for (int i = 0; i < 960; ++i) {
    RealRobotState real = real_at(-2 + i / 240.0, 2.79, 0, {1, 0, 0});  // 1 cm beside it
    real.sigma = 0.02;
    simulation.step(real, requests);
  }
  EXPECT_EQ(count(simulation.take_events(), EventKind::contact_started), 0U);
}

TEST(RealContacts, ModelledDoorsAndFloorsAreNoContacts) {
  SemanticModel model = room(6);
  model.entities.push_back(model_box("door", EntityLabel::door, {1, 0, 1}, {0.05, 0.9, 2}));
  Simulation simulation = make(model);
  EXPECT_EQ(count(drive_into(simulation, 0, 2, 0.5, 0.01), EventKind::contact_started), 0U);
}

TEST(RealContacts, TouchingADrawnVirtualWallIsAContact) {
  SemanticModel model = room(6);
  model.entities.push_back(model_box("glass", EntityLabel::wall, {1, 0, 1}, {0.05, 2, 2}));
  model.entities.back().is_virtual = true;
  Simulation simulation = make(model);
  const auto events = drive_into(simulation, 0, 0.76, 0.5, 0.01);
  ASSERT_EQ(count(events, EventKind::contact_started), 1U);
  EXPECT_EQ(events[0].pair, PairKind::real_virtual);
}

}  // namespace
}  // namespace parhelion::simulation

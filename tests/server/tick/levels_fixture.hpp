// A tick whose robot is simulated, driven by TELEOP at 20 Hz.
#pragma once

#include <cmath>
#include <optional>

#include "tests/server/tick/level_1.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::test {

inline Message teleop_at(double t, double vx, double wz = 0) {
  const std::int64_t utime = kStartUs + static_cast<std::int64_t>(t * 1e6);
  return message(channel::kTeleop, utime, TwistCommand{SensorTime::from_utime(utime), {vx, 0, wz}});
}

/// A source at (1, 0), a mine at (0, 0), a console at (-2.5, 0) with 2 m of range, a battery of 200 J.
inline Scenario hazardous() {
  Scenario scenario;
  Hazard mine, source;
  mine.name = "mine";
  mine.nearness = 0.3;
  source.name = "source";
  source.kind = HazardKind::radiation;
  source.position = {1, 0, 0.5};
  source.strength = 100;
  scenario.hazards = {mine, source};
  scenario.radio.emplace();
  scenario.radio->position = {-2.5, 0, 0.5};
  scenario.radio->sensitivity = 20 - 40.05 - 20 * std::log10(2.0);
  scenario.battery.emplace();
  scenario.battery->capacity = 200;
  return scenario;
}

class LevelsTest : public TickTest {
 protected:
  /// Runs until t (s after the start), with TELEOP at 20 Hz if given.
  void run(double until, std::optional<Twist2> twist = std::nullopt) {
    for (; time_ < until - 1e-9; time_ += 0.05) {
      if (twist) {
        feed(teleop_at(time_, twist->vx, twist->wz));
        continue;
      }
      advance_to(teleop_at(time_, 0).arrival);
    }
  }
  const simulation::RobotMotion& motion() { return *state_->simulation.robot_motion("trainee"); }
  std::vector<Event> events(EventKind kind) {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [kind](const Event& event) { return event.kind != kind; });
    return all;
  }

  double time_ = 0;
};

}  // namespace parhelion::test

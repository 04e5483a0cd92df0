// A scripted drive, graded from its published messages like a session log.
#pragma once

#include "server/training/grader.hpp"
#include "tests/server/runtime/scripted_drive.hpp"

namespace parhelion::test {

class GradedDrive : public ScriptedDrive {
 protected:
  void TearDown() override {
    if (HasFailure()) std::fputs((event_log() + marks()).c_str(), stderr);
  }
  /// A scenario of server/scenarios.
  void begin(const std::string& scenario) {
    load(std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/" + scenario);
    ASSERT_TRUE(configuration_.scenario.training.has_value());
    grader_.emplace(*configuration_.scenario.training, configuration_.model, configuration_.robot,
                    configuration_.robot.name, state_->simulation.now());
    wait(0.5);
  }
  void handle_output(const tick::Outputs::Entry& entry) override {
    if (!grader_) return;
    Event event;
    if (entry.channel == channel::kMrEvents && decode(entry.channel, entry.payload, event)) {
      grader_->take(event);
    } else if (entry.channel == channel::kMrWorld && decode(entry.channel, entry.payload, world_)) {
      grader_->take(world_);
    }
  }
  /// Drives to one position after the other.
  void drive_by(const std::vector<Eigen::Vector2d>& places, double speed, double limit = 40) {
    for (const Eigen::Vector2d& place : places)
      EXPECT_TRUE(drive_to(place, speed, limit)) << place.transpose() << " was not reached";
  }
  /// Waits until all tasks have ended, at most `limit` s.
  void stand(double limit) {
    drive(
        Twist2{}, [this] { return over(); }, limit);
  }
  /// Turns on the spot towards a position.
  void look_at(const Eigen::Vector2d& place) {
    const auto ask = [&] { return towards(place, 0); };
    const auto looks = [&] { return std::abs(towards(place, 0).wz) < 0.05; };
    EXPECT_TRUE(drive(ask, looks, 15));
  }
  bool over() const { return grade().ended; }
  training::Grade grade() const { return grader_->grade(); }
  std::string marks() const {
    const training::Grade all = grade();
    std::string text = "score " + std::to_string(all.score) + " of " + std::to_string(all.max) + "\n";
    for (const training::TaskGrade& task : all.tasks)
      text += "  " + task.name + " " + to_string(task.outcome) + "\n";
    for (const training::Deduction& deduction : all.deductions)
      text += "  -" + std::to_string(deduction.points) + " " + deduction.rule + "\n";
    return text;
  }

 private:
  std::optional<training::Grader> grader_;
  WorldMessage world_;
};

}  // namespace parhelion::test

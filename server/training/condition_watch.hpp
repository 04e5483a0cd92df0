// Evaluates one condition from an instant on.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "protocols/training.hpp"
#include "server/training/graded_world.hpp"

namespace parhelion::training {

/// One step of the recording: an event, or (event: nullptr) a new state of the world, which `world` has
/// already processed. Stamps do not decrease.
struct Moment {
  SimulationTime stamp;
  const Event* event = nullptr;
  const GradedWorld& world;
};

enum class Verdict : std::uint8_t { open, held, failed };

/// `condition` must outlive it. Events flagged undetectable do not count, and no virtual agent is near while
/// injection is degraded: only what the trainee could see is scored.
class ConditionWatch {
 public:
  /// `anew`: a condition that already holds at the beginning must first become false.
  ConditionWatch(const Condition& condition, SimulationTime begin, bool anew = false);

  /// Once held or failed, the verdict is final.
  Verdict look(const Moment& moment);
  /// The newest event that counted; none: only the world's state decided.
  const std::optional<Event>& cause() const { return cause_; }

 private:
  Verdict judge(const Moment& moment);
  Verdict judge_event(const Moment& moment);
  Verdict judge_avoid(const Moment& moment);
  Verdict judge_report(const Moment& moment);
  Verdict judge_handling(const Moment& moment);
  Verdict judge_pass(const Moment& moment);
  Verdict judge_parts(const Moment& moment);
  Verdict judge_order(const Moment& moment);
  Verdict held_for(bool now, SimulationTime stamp, double duration);
  Verdict count(const Event& event);

  const Condition* condition_;
  SimulationTime begin_;
  bool spent_ = false;  // holds since before it counted
  Verdict verdict_ = Verdict::open;
  std::optional<Event> cause_;
  std::uint64_t seen_ = 0;
  std::optional<double> came_from_;      // side of the door, m along its normal
  std::optional<SimulationTime> since_;  // start of a condition with a duration
  std::vector<ConditionWatch> parts_;    // of `then`, the one watched now
  std::size_t part_ = 0;
  std::vector<ConditionWatch> never_;
};

}  // namespace parhelion::training

// One condition, watched from an instant on.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "protocols/training.hpp"
#include "server/training/surroundings.hpp"

namespace parhelion::training {

/// One step of what was recorded: an event, or (event: nullptr) a new state of the world. The surroundings
/// have taken it already. Stamps do not go back.
struct Moment {
  SimulationTime stamp;
  const Event* event = nullptr;
  const Surroundings& around;
};

enum class Verdict : std::uint8_t { open, held, failed };

/// `condition` must outlive it. What is flagged unsensed is nothing to a condition about events, and nobody
/// virtual is near while injection is degraded: nothing is scored that the trainee could not see coming.
class ConditionWatch {
 public:
  /// `anew`: where things are so already at the beginning, they must first have been otherwise.
  ConditionWatch(const Condition& condition, SimulationTime begin, bool anew = false);

  /// Once held or failed it stays so.
  Verdict look(const Moment& moment);
  /// The newest event that counted; none: the world's state alone decided.
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
  bool spent_ = false;  // it is so since before it counted
  Verdict verdict_ = Verdict::open;
  std::optional<Event> cause_;
  std::uint64_t seen_ = 0;
  std::optional<double> came_from_;      // side of the door, m along its normal
  std::optional<SimulationTime> since_;  // when what has to last began
  std::vector<ConditionWatch> parts_;    // of `then` the one that is watched now
  std::size_t part_ = 0;
  std::vector<ConditionWatch> never_;
};

}  // namespace parhelion::training

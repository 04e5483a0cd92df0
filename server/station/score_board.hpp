// Score and tasks from MR_EVENTS: the server grades, pages only display.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/training.hpp"

namespace parhelion::station {

struct TaskLine {
  enum class State : std::uint8_t { waiting, running, done, failed };
  std::string name, text;
  State state = State::waiting;
  bool required = false;
  double points = 0, of = 0;    ///< awarded, and maximum
  std::optional<double> limit;  ///< s from its start
  std::optional<SimulationTime> began;
};
const char* to_string(TaskLine::State state);

/// Deductions by one rule so far.
struct PenaltyLine {
  std::string name;
  std::size_t count = 0;
  double points = 0;
};

class ScoreBoard {
 public:
  explicit ScoreBoard(const std::optional<Training>& training);

  /// False: the event changes nothing.
  bool take(const Event& event);
  void restart();

  bool graded() const { return training_.has_value(); }
  double score() const { return score_; }
  /// Points of the tasks done, and deducted ones: the score is their difference, at least 0.
  double awarded() const;
  double deducted() const;
  const std::vector<PenaltyLine>& penalties() const { return penalties_; }
  /// The training waits for its start.
  bool waiting() const { return training_ && training_->on_command && !began_; }
  /// When its clock started: with the session at `start`, unless an event told it. None: it waits.
  std::optional<SimulationTime> began(SimulationTime start) const;
  double possible() const { return possible_; }                              ///< points of all tasks together
  double pass_mark() const { return training_ ? training_->pass_mark : 0; }  ///< fraction
  std::optional<double> limit() const { return training_ ? training_->limit : std::nullopt; }  ///< s
  /// The final result of the grading; none: still running.
  const std::optional<std::string>& verdict() const { return verdict_; }
  /// By the grader's rule.
  bool passed() const;
  const std::vector<TaskLine>& tasks() const { return tasks_; }
  /// s left of a task; none: no time limit, or not running.
  std::optional<double> left(const TaskLine& task, SimulationTime now) const;

 private:
  void deduct(const std::string& rule, double points);

  const std::optional<Training>& training_;
  std::vector<TaskLine> tasks_;
  double score_ = 0, possible_ = 0;
  std::optional<std::string> verdict_;
  std::vector<PenaltyLine> penalties_;
  std::optional<SimulationTime> began_;
};

}  // namespace parhelion::station

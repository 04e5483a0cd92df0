// Grading: a function of the recording only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/training.hpp"
#include "server/training/condition_watch.hpp"
#include "server/training/graded_world.hpp"
#include "server/training/touched_persons.hpp"

namespace parhelion::training {

enum class TaskOutcome : std::uint8_t {
  waiting,  ///< not started yet
  open,
  done,
  failed,
  out_of_time
};
const char* to_string(TaskOutcome outcome);

struct TaskGrade {
  std::string name;
  bool required = false;
  TaskOutcome outcome = TaskOutcome::waiting;
  double points = 0;  ///< awarded
  std::optional<SimulationTime> began, ended;
  std::optional<Event> cause;  ///< the final event; none: time or state decided
};

/// A deduction by a penalty.
struct Deduction {
  SimulationTime at;
  std::string rule;            ///< name of the penalty
  double points = 0;           ///< > 0
  std::optional<Event> cause;  ///< none: state decided
};

struct Grade {
  SimulationTime begin, end;
  std::vector<TaskGrade> tasks;       ///< as in the scenario
  std::vector<Deduction> deductions;  ///< ordered by time
  double awarded = 0, deducted = 0;
  double max = 0;       ///< points of all tasks
  double score = 0;     ///< awarded - deducted, at least 0
  double fraction = 0;  ///< score / max; 0 if there are no points
  std::string grade;    ///< by the scale; empty: below its lowest grade, or no scale
  bool passed =
      false;           ///< fraction at or above the pass mark, all required tasks done, and no person touched
  bool ended = false;  ///< all tasks have ended, or time is over; later input changes nothing
  bool complete = false;  ///< ended, or a person ended the session; otherwise the log is truncated
};

class Grader {
 public:
  /// `robot`: the trainee's, if the training names none. A training that starts on a command begins with the
  /// event training_started, not at `begin`. The references must outlive this.
  Grader(const Training& training, const SemanticModel& model, const RobotDescription& description,
         const std::string& robot, SimulationTime begin);

  /// Call in the order of the recording.
  void take(const Event& event);
  void take(const WorldMessage& world);
  /// The session was stopped on purpose: missing tasks are not due to a truncated log.
  void close(SimulationTime end);
  /// The current grade.
  Grade grade() const;
  /// Deductions so far; cheaper than grade().
  const std::vector<Deduction>& deductions() const { return deductions_; }
  /// Only Grade::score.
  double score() const;
  /// Changes since the last call, as events (is_grading()). Live grading publishes them on MR_EVENTS; grading
  /// a log skips them there.
  std::vector<Event> take_events();

 private:
  struct Running {
    const Task* task;
    TaskGrade grade;
    std::optional<ConditionWatch> done, failed;
  };
  struct Rule {
    const Penalty* penalty;
    ConditionWatch watch;
    double deducted = 0;
  };
  void start(SimulationTime at);
  bool is_over(SimulationTime now) const;  ///< by its time limit
  void look(const Moment& moment);
  void begin_tasks(SimulationTime now);
  void look_at_task(Running& running, const Moment& moment);
  void look_at_rule(Rule& rule, const Moment& moment);
  void deduct(SimulationTime at, const std::string& rule, double points, const std::optional<Event>& cause);
  void fail_for(const Event& touched);
  bool all_ended() const;
  void end(Running& running, SimulationTime at, TaskOutcome outcome, const ConditionWatch* by);
  void end_all(SimulationTime at);
  void report(EventKind kind, SimulationTime at, const std::string& object, double value,
              const std::optional<Event>& cause, const std::string& text);
  void report_score(SimulationTime at, const std::string& object, double points,
                    const std::optional<Event>& cause);

  const Training& training_;
  GradedWorld world_;
  TouchedPersons touched_;
  bool person_touched_ = false;
  std::vector<Running> tasks_;
  std::vector<Rule> rules_;
  std::vector<Deduction> deductions_;
  double deducted_ = 0;  // sum of deductions_
  std::vector<Event> events_;
  SimulationTime begin_, now_;
  std::optional<SimulationTime> closed_;
  bool waiting_, ended_ = false;
};

}  // namespace parhelion::training

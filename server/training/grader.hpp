// Grading: a function of what was recorded, and of nothing else.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocols/training.hpp"
#include "server/training/condition_watch.hpp"
#include "server/training/surroundings.hpp"

namespace parhelion::training {

enum class TaskOutcome : std::uint8_t {
  waiting,  ///< its turn has not come
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
  double points = 0;  ///< earned
  std::optional<SimulationTime> began, ended;
  std::optional<Event> cause;  ///< what ended it; none: time, or where things were
};

/// What a rule took.
struct Charge {
  SimulationTime at;
  std::string rule;            ///< name of the penalty
  double points = 0;           ///< > 0
  std::optional<Event> cause;  ///< none: where things were
};

struct Grade {
  SimulationTime begin, end;
  std::vector<TaskGrade> tasks;  ///< as in the scenario
  std::vector<Charge> charges;   ///< in the order of time
  double earned = 0, charged = 0;
  double most = 0;        ///< points of all tasks together
  double score = 0;       ///< earned - charged, at least 0
  double share = 0;       ///< score / most; 0 where there is nothing to earn
  std::string grade;      ///< by the scale; empty: below its last step, or there is none
  bool passed = false;    ///< share at the pass mark or above, and all required tasks done
  bool ended = false;     ///< all tasks have, or the time is over; what comes later changes nothing
  bool complete = false;  ///< ended, or the session was ended by a person; else the log stops in the middle
};

class Grader {
 public:
  /// `robot`: the trainee's, where the training names none. The references must outlive this.
  Grader(const Training& training, const SemanticModel& model, const RobotDescription& description,
         const std::string& robot, SimulationTime begin);

  /// In the order in which they were recorded.
  void take(const Event& event);
  void take(const WorldMessage& world);
  /// The session was stopped on purpose: what it lacks is not for lack of a log.
  void close(SimulationTime end);
  /// As it is now.
  Grade grade() const;
  /// So far; cheaper than all of grade().
  const std::vector<Charge>& charges() const { return charges_; }
  /// Grade::score, alone.
  double score() const;
  /// What has changed since this was asked last, as events (is_grading()); empty: nothing. What was graded
  /// live has them on MR_EVENTS; graded again they are read over.
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
    double charged = 0;
  };
  void look(const Moment& moment);
  void begin_tasks(SimulationTime now);
  void look_at_task(Running& running, const Moment& moment);
  void look_at_rule(Rule& rule, const Moment& moment);
  bool all_ended() const;
  void end(Running& running, SimulationTime at, TaskOutcome outcome, const ConditionWatch* by);
  void end_all(SimulationTime at);
  void say(EventKind kind, SimulationTime at, const std::string& object, double value,
           const std::optional<Event>& cause, const std::string& text);
  void say_score(SimulationTime at, const std::string& object, double points,
                 const std::optional<Event>& cause);

  const Training& training_;
  Surroundings around_;
  std::vector<Running> tasks_;
  std::vector<Rule> rules_;
  std::vector<Charge> charges_;
  double charged_ = 0;  // all of them together
  std::vector<Event> events_;
  SimulationTime begin_, now_;
  std::optional<SimulationTime> closed_;
  bool ended_ = false;
};

}  // namespace parhelion::training

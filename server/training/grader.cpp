#include "server/training/grader.hpp"

#include <algorithm>
#include <utility>

#include "server/training/grading_text.hpp"

namespace parhelion::training {

Grader::Grader(const Training& training, const SemanticModel& model, const RobotDescription& description,
               const std::string& robot, SimulationTime begin)
    : training_(training),
      world_(model, description, training.robot.empty() ? robot : training.robot),
      touched_(world_.robot()),
      begin_(begin),
      now_(begin),
      waiting_(training.on_command) {
  for (const Task& task : training.tasks)
    tasks_.push_back({&task, {task.name, task.required, {}, 0, {}, {}, {}}, {}, {}});
  if (!waiting_) start(begin);
}

void Grader::start(SimulationTime at) {
  waiting_ = false;
  begin_ = at;
  for (const Penalty& penalty : training_.penalties)
    rules_.push_back({&penalty, ConditionWatch(penalty.when, at), 0});
  begin_tasks(at);
}

void Grader::take(const Event& event) {
  if (ended_ || is_grading(event.kind)) return;
  world_.take(event);
  now_ = std::max(now_, event.stamp);
  if (waiting_ && event.kind == EventKind::training_started) start(event.stamp);
  if (touched_.take(event) && training_.person_contact_fails && !is_over(event.stamp)) fail_for(event);
  if (!waiting_) look({event.stamp, &event, world_});
}

void Grader::take(const WorldMessage& world) {
  if (ended_) return;
  world_.take(world);
  touched_.take(world);
  now_ = std::max(now_, SimulationTime{world.stamp.ns});
  if (!waiting_) look({now_, nullptr, world_});
}

void Grader::close(SimulationTime end) {
  if (closed_) return;
  closed_ = end;
  if (ended_) return;
  const Grade grade = this->grade();
  report(EventKind::grading_ended, end, {}, grade.score, {}, verdict_text(grade));
}

std::vector<Event> Grader::take_events() { return std::exchange(events_, {}); }

void Grader::begin_tasks(SimulationTime now) {
  for (Running& running : tasks_) {
    if (running.grade.outcome == TaskOutcome::open && training_.in_order) return;
    if (running.grade.outcome != TaskOutcome::waiting) continue;
    running.grade.outcome = TaskOutcome::open;
    running.grade.began = now;
    running.done.emplace(running.task->done, now);
    if (!running.task->failed.empty()) running.failed.emplace(running.task->failed.front(), now);
    report(EventKind::task_started, now, running.task->name, running.task->points, {}, running.task->text);
    if (training_.in_order) return;
  }
}

bool Grader::all_ended() const {
  return std::all_of(tasks_.begin(), tasks_.end(), [](const Running& running) {
    return running.grade.outcome != TaskOutcome::waiting && running.grade.outcome != TaskOutcome::open;
  });
}

bool Grader::is_over(SimulationTime now) const {
  return training_.limit && now > begin_ + seconds(*training_.limit);
}

void Grader::look(const Moment& moment) {
  if (is_over(moment.stamp)) return end_all(begin_ + seconds(*training_.limit));
  for (Rule& rule : rules_) look_at_rule(rule, moment);
  for (Running& running : tasks_) {
    if (running.grade.outcome == TaskOutcome::open) look_at_task(running, moment);
  }
  begin_tasks(moment.stamp);
  if (all_ended()) end_all(moment.stamp);
}

/// Open and waiting tasks are out of time.
void Grader::end_all(SimulationTime at) {
  for (Running& running : tasks_) {
    if (running.grade.outcome == TaskOutcome::open) end(running, at, TaskOutcome::out_of_time, nullptr);
    if (running.grade.outcome == TaskOutcome::waiting) running.grade.outcome = TaskOutcome::out_of_time;
  }
  ended_ = true;
  now_ = at;
  const Grade grade = this->grade();
  report(EventKind::grading_ended, at, {}, grade.score, {}, verdict_text(grade));
}

void Grader::end(Running& running, SimulationTime at, TaskOutcome outcome, const ConditionWatch* by) {
  TaskGrade& grade = running.grade;
  grade.outcome = outcome;
  grade.ended = at;
  if (by) grade.cause = by->cause();
  if (outcome == TaskOutcome::done) grade.points = running.task->points;
  const bool late = outcome == TaskOutcome::out_of_time;
  report(outcome == TaskOutcome::done ? EventKind::task_done : EventKind::task_failed, at, grade.name,
         grade.points, grade.cause, late ? "out of time" : event_text(grade.cause));
  if (grade.points > 0) report_score(at, grade.name, grade.points, grade.cause);
}

void Grader::look_at_task(Running& running, const Moment& moment) {
  if (running.task->limit && moment.stamp > *running.grade.began + seconds(*running.task->limit))
    return end(running, moment.stamp, TaskOutcome::out_of_time, nullptr);
  if (running.failed && running.failed->look(moment) == Verdict::held)
    return end(running, moment.stamp, TaskOutcome::failed, &*running.failed);
  const Verdict verdict = running.done->look(moment);
  if (verdict == Verdict::open) return;
  end(running, moment.stamp, verdict == Verdict::held ? TaskOutcome::done : TaskOutcome::failed,
      &*running.done);
}

void Grader::look_at_rule(Rule& rule, const Moment& moment) {
  const Verdict verdict = rule.watch.look(moment);
  if (verdict == Verdict::open) return;
  const std::optional<Event> cause = rule.watch.cause();
  rule.watch = ConditionWatch(rule.penalty->when, moment.stamp, true);
  if (verdict == Verdict::failed) return;
  double points = rule.penalty->points;
  if (cause) points += rule.penalty->per_impulse * cause->impulse;
  if (rule.penalty->max) points = std::min(points, *rule.penalty->max - rule.deducted);
  if (!(points > 0)) return;
  rule.deducted += points;
  deduct(moment.stamp, rule.penalty->name, points, cause);
}

void Grader::deduct(SimulationTime at, const std::string& rule, double points,
                    const std::optional<Event>& cause) {
  const double before = score();
  deductions_.push_back({at, rule, points, cause});
  deducted_ += points;
  report(EventKind::points_deducted, at, rule, points, cause, event_text(cause));
  if (score() != before) report_score(at, rule, -points, cause);
}

/// As many points as there are: nothing that is done before or after outweighs it.
void Grader::fail_for(const Event& touched) {
  if (std::exchange(person_touched_, true)) return;
  double points = 0;
  for (const Running& running : tasks_) points += running.task->points;
  deduct(touched.stamp, kPersonTouched, std::max(points, 1.0), touched);
}

void Grader::report(EventKind kind, SimulationTime at, const std::string& object, double value,
                    const std::optional<Event>& cause, const std::string& text) {
  Event event;
  event.stamp = at;
  event.kind = kind;
  event.subject = world_.robot();
  event.object = object;
  event.value = value;
  event.text = text;
  if (cause) event.position = cause->position;
  events_.push_back(std::move(event));
}

void Grader::report_score(SimulationTime at, const std::string& object, double points,
                          const std::optional<Event>& cause) {
  report(EventKind::score_changed, at, object, score(), cause, points_text(points));
}

double Grader::score() const {
  double awarded = 0;
  for (const Running& running : tasks_) awarded += running.grade.points;
  return std::max(0.0, awarded - deducted_);
}

Grade Grader::grade() const {
  Grade grade;
  grade.begin = begin_;
  grade.end = closed_ && !ended_ ? std::max(now_, *closed_) : now_;
  grade.deductions = deductions_;
  bool required_done = true;
  for (const Running& running : tasks_) {
    grade.tasks.push_back(running.grade);
    grade.awarded += running.grade.points;
    grade.max += running.task->points;
    if (running.task->required && running.grade.outcome != TaskOutcome::done) required_done = false;
  }
  grade.deducted = deducted_;
  grade.score = score();
  grade.fraction = grade.max > 0 ? grade.score / grade.max : 0;
  const auto step = std::find_if(training_.grades.begin(), training_.grades.end(),
                                 [&](const GradeStep& each) { return grade.fraction >= each.from; });
  if (step != training_.grades.end()) grade.grade = step->name;
  grade.passed = required_done && !person_touched_ && grade.fraction >= training_.pass_mark;
  grade.ended = ended_;
  grade.complete = ended_ || closed_.has_value();
  return grade;
}

}  // namespace parhelion::training

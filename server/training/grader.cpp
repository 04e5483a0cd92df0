#include "server/training/grader.hpp"

#include <algorithm>

namespace parhelion {

const char* to_string(TaskOutcome outcome) {
  switch (outcome) {
    case TaskOutcome::waiting:
      return "waiting";
    case TaskOutcome::open:
      return "open";
    case TaskOutcome::done:
      return "done";
    case TaskOutcome::failed:
      return "failed";
    case TaskOutcome::out_of_time:
      return "out_of_time";
  }
  return "";
}

Grader::Grader(const Training& training, const SemanticModel& model, const RobotDescription& description,
               const std::string& robot, SimulationTime begin)
    : training_(training),
      around_(model, description, training.robot.empty() ? robot : training.robot),
      begin_(begin),
      now_(begin) {
  for (const Task& task : training.tasks)
    tasks_.push_back({&task, {task.name, task.required, {}, 0, {}, {}, {}}, {}, {}});
  for (const Penalty& penalty : training.penalties)
    rules_.push_back({&penalty, ConditionWatch(penalty.when, begin), 0});
  begin_tasks(begin);
}

void Grader::take(const Event& event) {
  if (ended_) return;
  around_.take(event);
  now_ = std::max(now_, event.stamp);
  look({event.stamp, &event, around_});
}

void Grader::take(const WorldMessage& world) {
  if (ended_) return;
  around_.take(world);
  now_ = std::max(now_, SimulationTime{world.stamp.ns});
  look({now_, nullptr, around_});
}

void Grader::close(SimulationTime end) {
  if (!ended_) now_ = std::max(now_, end);
  closed_ = true;
}

void Grader::begin_tasks(SimulationTime now) {
  for (Running& running : tasks_) {
    if (running.grade.outcome == TaskOutcome::open && training_.in_order) return;
    if (running.grade.outcome != TaskOutcome::waiting) continue;
    running.grade.outcome = TaskOutcome::open;
    running.grade.began = now;
    running.done.emplace(running.task->done, now);
    if (!running.task->failed.empty()) running.failed.emplace(running.task->failed.front(), now);
    if (training_.in_order) return;
  }
}

bool Grader::all_ended() const {
  return std::all_of(tasks_.begin(), tasks_.end(), [](const Running& running) {
    return running.grade.outcome != TaskOutcome::waiting && running.grade.outcome != TaskOutcome::open;
  });
}

void Grader::look(const Moment& moment) {
  if (training_.limit && moment.stamp > begin_ + seconds(*training_.limit)) {
    ended_ = true;
    now_ = begin_ + seconds(*training_.limit);
    for (Running& running : tasks_) {
      if (running.grade.outcome == TaskOutcome::open) running.grade.ended = now_;
      if (running.grade.outcome == TaskOutcome::open || running.grade.outcome == TaskOutcome::waiting)
        running.grade.outcome = TaskOutcome::out_of_time;
    }
    return;
  }
  for (Rule& rule : rules_) look_at_rule(rule, moment);
  for (Running& running : tasks_) {
    if (running.grade.outcome == TaskOutcome::open) look_at_task(running, moment);
  }
  begin_tasks(moment.stamp);
  ended_ = all_ended();
}

void Grader::look_at_task(Running& running, const Moment& moment) {
  TaskGrade& grade = running.grade;
  const auto end = [&](TaskOutcome outcome, const ConditionWatch* by) {
    grade.outcome = outcome;
    grade.ended = moment.stamp;
    if (by) grade.cause = by->cause();
  };
  if (running.task->limit && moment.stamp > *grade.began + seconds(*running.task->limit))
    return end(TaskOutcome::out_of_time, nullptr);
  if (running.failed && running.failed->look(moment) == Verdict::held)
    return end(TaskOutcome::failed, &*running.failed);
  const Verdict verdict = running.done->look(moment);
  if (verdict == Verdict::open) return;
  end(verdict == Verdict::held ? TaskOutcome::done : TaskOutcome::failed, &*running.done);
  if (verdict == Verdict::held) grade.points = running.task->points;
}

void Grader::look_at_rule(Rule& rule, const Moment& moment) {
  const Verdict verdict = rule.watch.look(moment);
  if (verdict == Verdict::open) return;
  const std::optional<Event> cause = rule.watch.cause();
  rule.watch = ConditionWatch(rule.penalty->when, moment.stamp, true);
  if (verdict == Verdict::failed) return;
  double points = rule.penalty->points;
  if (cause) points += rule.penalty->per_impulse * cause->impulse;
  if (rule.penalty->most) points = std::min(points, *rule.penalty->most - rule.charged);
  if (!(points > 0)) return;
  rule.charged += points;
  charges_.push_back({moment.stamp, rule.penalty->name, points, cause});
}

Grade Grader::grade() const {
  Grade grade;
  grade.begin = begin_;
  grade.end = now_;
  grade.charges = charges_;
  bool required_done = true;
  for (const Running& running : tasks_) {
    grade.tasks.push_back(running.grade);
    grade.earned += running.grade.points;
    grade.most += running.task->points;
    if (running.task->required && running.grade.outcome != TaskOutcome::done) required_done = false;
  }
  for (const Charge& charge : charges_) grade.charged += charge.points;
  grade.score = std::max(0.0, grade.earned - grade.charged);
  grade.share = grade.most > 0 ? grade.score / grade.most : 0;
  const auto step = std::find_if(training_.grades.begin(), training_.grades.end(),
                                 [&](const GradeStep& each) { return grade.share >= each.from; });
  if (step != training_.grades.end()) grade.grade = step->name;
  grade.passed = required_done && grade.share >= training_.pass_mark;
  grade.ended = ended_;
  grade.complete = ended_ || closed_;
  return grade;
}

}  // namespace parhelion

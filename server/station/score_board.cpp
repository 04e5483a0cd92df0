#include "server/station/score_board.hpp"

#include <algorithm>

namespace parhelion::station {

const char* to_string(TaskLine::State state) {
  static constexpr const char* words[] = {"waiting", "running", "done", "failed"};
  return words[static_cast<std::size_t>(state)];
}

ScoreBoard::ScoreBoard(const std::optional<Training>& training) : training_(training) { restart(); }

void ScoreBoard::restart() {
  tasks_.clear();
  score_ = possible_ = 0;
  verdict_.reset();
  penalties_.clear();
  began_.reset();
  if (!training_) return;
  for (const Task& task : training_->tasks) {
    tasks_.push_back({task.name, task.text, {}, task.required, 0, task.points, task.limit, {}});
    possible_ += task.points;
  }
}

double ScoreBoard::awarded() const {
  double points = 0;
  for (const TaskLine& task : tasks_) points += task.points;
  return points;
}

double ScoreBoard::deducted() const {
  double points = 0;
  for (const PenaltyLine& penalty : penalties_) points += penalty.points;
  return points;
}

std::optional<SimulationTime> ScoreBoard::began(SimulationTime start) const {
  return began_ || waiting() ? began_ : std::optional(start);
}

void ScoreBoard::deduct(const std::string& rule, double points) {
  auto line = std::find_if(penalties_.begin(), penalties_.end(),
                           [&](const PenaltyLine& each) { return each.name == rule; });
  if (line == penalties_.end()) line = penalties_.insert(line, {rule, 0, 0});
  ++line->count;
  line->points += points;
}

bool ScoreBoard::take(const Event& event) {
  if (event.kind == EventKind::training_started) began_ = event.stamp;
  if (!is_grading(event.kind)) return event.kind == EventKind::training_started;
  if (event.kind == EventKind::points_deducted) deduct(event.object, event.value);
  if (event.kind == EventKind::score_changed) score_ = event.value;
  if (event.kind == EventKind::grading_ended) {
    score_ = event.value;
    verdict_ = event.text;
  }
  const auto task = std::find_if(tasks_.begin(), tasks_.end(),
                                 [&](const TaskLine& each) { return each.name == event.object; });
  if (task == tasks_.end()) return true;
  if (event.kind == EventKind::task_started) {
    task->state = TaskLine::State::running;
    task->began = event.stamp;
  }
  if (event.kind == EventKind::task_done) {
    task->state = TaskLine::State::done;
    task->points = event.value;
  }
  if (event.kind == EventKind::task_failed) task->state = TaskLine::State::failed;
  return true;
}

bool ScoreBoard::passed() const {
  const bool required_done = std::all_of(tasks_.begin(), tasks_.end(), [](const TaskLine& task) {
    return !task.required || task.state == TaskLine::State::done;
  });
  return required_done && (possible_ > 0 ? score_ / possible_ : 0) >= pass_mark();
}

std::optional<double> ScoreBoard::left(const TaskLine& task, SimulationTime now) const {
  if (!task.limit || !task.began || task.state != TaskLine::State::running) return std::nullopt;
  return std::max(0.0, *task.limit - (now - *task.began).seconds());
}

}  // namespace parhelion::station

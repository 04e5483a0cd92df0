#include "server/simulation/building/router.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::simulation {

/// Rounded: floors are never exactly level, and robots of many heights share a grid.
RouteGrid& Router::grid(const std::shared_ptr<const Building>& building, double exact_floor,
                        double exact_height) {
  const double floor = std::round(exact_floor / 0.05) * 0.05;
  const double height = std::ceil(exact_height / 0.25) * 0.25;
  const auto known = std::find_if(grids_.begin(), grids_.end(),
                                  [&](const auto& grid) { return grid->is_of(building, floor, height); });
  if (known != grids_.end()) {
    std::rotate(known, known + 1, grids_.end());
    return *grids_.back();
  }
  if (grids_.size() == kMaxGrids) {
    search_.reset();  // it may use the grid that is removed; it starts again
    grids_.erase(grids_.begin());
  }
  grids_.push_back(std::make_unique<RouteGrid>(building, floor, height));
  return *grids_.back();
}

const std::vector<const FixedObstacle*>& Router::doors(const std::shared_ptr<const Building>& building) {
  if (doors_of_ == building) return doors_;
  doors_of_ = building;
  doors_.clear();
  for (const FixedObstacle& obstacle : building->obstacles()) {
    if (obstacle.label == EntityLabel::door) doors_.push_back(&obstacle);
  }
  return doors_;
}

void Router::ask(BodyId who, const std::shared_ptr<const Building>& building, double floor, double height,
                 RouteQuery query, bool round_agents) {
  forget(who);
  waiting_.push_back({who, building, floor, height, std::move(query), round_agents});
}

void Router::forget(BodyId who) {
  if (!waiting_.empty() && waiting_.front().who == who) search_.reset();
  std::erase_if(waiting_, [who](const Question& question) { return question.who == who; });
}

void Router::work(std::vector<Answer>& answers) {
  std::size_t cells = kCellsPerStep;
  while (cells > 0 && !waiting_.empty()) {
    const Question& question = waiting_.front();
    if (!search_) {
      RouteGrid& on = grid(question.building, question.floor, question.height);
      search_.emplace(on, question.query, ++searches_);
    }
    const RouteSearch::Result result = search_->work(cells);
    if (result == RouteSearch::Result::searching) return;
    Answer answer{question.who, result, {}, question.round_agents};
    if (result == RouteSearch::Result::found) answer.points = search_->smooth();
    answers.push_back(std::move(answer));
    search_.reset();
    waiting_.pop_front();
  }
}

}  // namespace parhelion::simulation

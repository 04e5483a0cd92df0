// Routes through a building: A* against Dijkstra, and the guarantees of a route.
#include <gtest/gtest.h>
// After gtest.h, which it needs but does not include.
#include <rapidcheck/gtest.h>

#include <map>
#include <queue>
#include <set>

#include "server/simulation/building/route_search.hpp"
#include "tests/model_box.hpp"

namespace parhelion::simulation {
namespace {

using test::model_box;

std::shared_ptr<const Building> building_of(const SemanticModel& model) {
  auto building = Building::create(model);
  EXPECT_TRUE(building.ok());
  return *building;
}

/// A room of 6 m with random furniture and walls.
SemanticModel any_room() {
  SemanticModel model;
  const auto within = [](double low, double high) {
    return low + (high - low) * *rc::gen::inRange(0, 1001) / 1000;
  };
  model.entities.push_back(model_box("a", EntityLabel::wall, {3, 0, 1}, {0.1, 6, 2}));
  model.entities.push_back(model_box("b", EntityLabel::wall, {-3, 0, 1}, {0.1, 6, 2}));
  model.entities.push_back(model_box("c", EntityLabel::wall, {0, 3, 1}, {6, 0.1, 2}));
  model.entities.push_back(model_box("d", EntityLabel::wall, {0, -3, 1}, {6, 0.1, 2}));
  for (int i = *rc::gen::inRange(0, 7); i > 0; --i) {
    model.entities.push_back(model_box("box " + std::to_string(i), EntityLabel::unknown,
                                       {within(-2.5, 2.5), within(-2.5, 2.5), 0.5},
                                       {within(0.1, 2.5), within(0.1, 0.5), 1}, within(-1.6, 1.6)));
  }
  return model;
}

/// Reference implementation: all cells in the order of their cost, without a heuristic.
std::optional<std::uint32_t> dijkstra(RouteSearch& costs, const Eigen::Vector2d& from,
                                      const Eigen::Vector2d& to) {
  using Entry = std::pair<std::uint32_t, std::pair<int, int>>;
  const RouteCell start = RouteGrid::cell_of(from), goal = RouteGrid::cell_of(to);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  std::map<std::pair<int, int>, std::uint32_t> best;
  if (costs.factor(start) == 0) return std::nullopt;
  open.push({0, {start.x, start.y}});
  std::set<std::pair<int, int>> done;
  while (!open.empty()) {
    const auto [cost, at] = open.top();
    open.pop();
    if (!done.insert(at).second) continue;
    if (RouteCell{at.first, at.second} == goal) return cost;
    for (const RouteStep& step : kRouteSteps) {
      const RouteCell next{at.first + step.x, at.second + step.y};
      const std::uint32_t factor = costs.factor(next);
      const bool corner = step.x != 0 && step.y != 0 &&
                          (costs.factor({at.first + step.x, at.second}) == 0 ||
                           costs.factor({at.first, at.second + step.y}) == 0);
      if (factor == 0 || corner || RouteGrid::center(next).lpNorm<Eigen::Infinity>() > 6.05) continue;
      const std::uint32_t reached = cost + step.length * factor + costs.door_cost(next);
      const auto known = best.find({next.x, next.y});
      if (known != best.end() && known->second <= reached) continue;
      best[{next.x, next.y}] = reached;
      open.push({reached, {next.x, next.y}});
    }
  }
  return std::nullopt;
}

RouteSearch::Result to_the_end(RouteSearch& search, std::size_t piece) {
  while (true) {
    std::size_t cells = piece;
    const auto result = search.work(cells);
    if (result != RouteSearch::Result::searching) return result;
  }
}

RC_GTEST_PROP(Route, CostEqualsDijkstraAndTheRouteKeepsItsDistance, ()) {
  const auto building = building_of(any_room());
  RouteGrid grid(building, 0, 1.5);
  const auto place = [] {
    return Eigen::Vector2d(*rc::gen::inRange(-27, 28) * 0.1 + 0.05, *rc::gen::inRange(-27, 28) * 0.1 + 0.05);
  };
  RouteQuery query{place(), place(), 0.3, {}, {}};
  if (*rc::gen::arbitrary<bool>()) query.blocked.push_back(make_disc(place(), 0.4));
  if (*rc::gen::arbitrary<bool>()) {
    const Eigen::Vector2d hinge = place();
    query.doors.push_back(make_segment(hinge, hinge + Eigen::Vector2d(0.9, 0), 0.02));
  }
  RouteSearch search(grid, query, 1);
  RC_PRE(search.factor(RouteGrid::cell_of(query.start)) > 0);
  const auto result = to_the_end(search, static_cast<std::size_t>(*rc::gen::inRange(1, 4000)));
  RouteSearch costs(grid, query, 2);
  const auto reference = dijkstra(costs, query.start, query.goal);
  RC_ASSERT((result == RouteSearch::Result::found) == reference.has_value());
  if (!reference) return;
  RC_ASSERT(search.cost() == *reference);
  RouteSearch again(grid, query, 3);
  RC_ASSERT(to_the_end(again, 100'000) == RouteSearch::Result::found);
  const auto path = again.smooth();
  RC_ASSERT(path == again.smooth());
  RC_ASSERT(path.front() == query.start && path.back() == query.goal);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Footprint piece = make_segment(path[i - 1], path[i], 0);
    // Between neighbouring cells clearance is known only at their centres; end points lie anywhere in theirs.
    const double loose = (path[i] - path[i - 1]).norm() < 0.15 ? 0.08 : 0.002;
    for (const FixedObstacle& obstacle : building->obstacles())
      RC_ASSERT(signed_distance(piece, obstacle.footprint) >= query.clearance - loose);
    for (const Footprint& other : query.blocked)
      RC_ASSERT(signed_distance(piece, other) >= query.clearance - loose);
  }
}

TEST(Route, FindsStraightRoutesInTheOpenAndNoneFromClosedRooms) {
  SemanticModel model;
  for (const double s : {-1.0, 1.0}) {
    model.entities.push_back(model_box("x" + std::to_string(s), EntityLabel::wall, {s, 0, 1}, {0.1, 2.1, 2}));
    model.entities.push_back(model_box("y" + std::to_string(s), EntityLabel::wall, {0, s, 1}, {2.1, 0.1, 2}));
  }
  RouteGrid grid(building_of(model), 0, 1.5);
  RouteSearch out(grid, {{0, 0}, {5, 0}, 0.3, {}, {}}, 1);
  EXPECT_EQ(to_the_end(out, 500), RouteSearch::Result::none);
  RouteSearch in(grid, {{5, 0}, {0, 0}, 0.3, {}, {}}, 2);
  EXPECT_EQ(to_the_end(in, 500), RouteSearch::Result::none);
  RouteGrid nothing(building_of({}), 0, 1.5);
  RouteSearch open(nothing, {{0, 0}, {7, 3}, 0.3, {}, {}}, 1);
  ASSERT_EQ(to_the_end(open, 500), RouteSearch::Result::found);
  EXPECT_EQ(open.smooth().size(), 2U);
}

TEST(Route, PushesADoorOpenWhereTheDetourIsLong) {
  SemanticModel model;  // a wall with a gap of 1 m at y = 0 and its end at y = 20 or y = 1
  for (const double end : {20.0, 1.0}) {
    model.entities = {model_box("below", EntityLabel::wall, {0, -20.5, 1}, {0.1, 40, 2}),
                      model_box("above", EntityLabel::wall, {0, (0.5 + end) / 2, 1}, {0.1, end - 0.5, 2})};
    RouteGrid grid(building_of(model), 0, 1.5);
    RouteSearch search(grid, {{-2, 0}, {2, 0}, 0.3, {}, {make_segment({0, -0.5}, {0, 0.5}, 0.02)}}, 1);
    ASSERT_EQ(to_the_end(search, 10'000), RouteSearch::Result::found);
    double largest = 0;
    for (const auto& p : search.cells()) largest = std::max(largest, p.y());
    EXPECT_EQ(largest > 1, end == 1.0) << end;
  }
}

TEST(Route, ASearchDoesLimitedWorkPerStep) {
  RouteGrid grid(building_of({}), 0, 1.5);
  RouteSearch search(grid, {{0, 0}, {30, 20}, 0.3, {}, {}}, 1);
  int pieces = 0;
  while (true) {
    std::size_t cells = 200;
    if (search.work(cells) != RouteSearch::Result::searching) break;
    EXPECT_EQ(cells, 0U);
    ++pieces;
  }
  EXPECT_GT(pieces, 1);
}

}  // namespace
}  // namespace parhelion::simulation

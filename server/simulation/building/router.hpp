// Path search for all agents, one after the other, with bounded work in each step.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "server/simulation/building/route_search.hpp"

namespace parhelion::simulation {

class Router {
 public:
  /// Limit of expanded cells per step: about 0.5 ms.
  static constexpr std::size_t kCellsPerStep = 2000;

  struct Answer {
    BodyId who = 0;
    RouteSearch::Result result = RouteSearch::Result::none;
    std::vector<Eigen::Vector2d> points;  ///< m, map, starting at the agent's position
    bool round_agents = false;            ///< as requested
  };

  /// The grid of a floor (to 5 cm) for agents of `height` (to 25 cm), m. Valid until the next call with other
  /// values.
  RouteGrid& grid(const std::shared_ptr<const Building>& building, double floor, double height);
  /// The building's obstacles that are doors.
  const std::vector<const FixedObstacle*>& doors(const std::shared_ptr<const Building>& building);

  /// `who`: an agent's first body; replaces its earlier request. `round_agents`: the blocked areas include
  /// standing agents.
  void ask(BodyId who, const std::shared_ptr<const Building>& building, double floor, double height,
           RouteQuery query, bool round_agents);
  void forget(BodyId who);
  /// Continues the searches; appends results in the order of the requests.
  void work(std::vector<Answer>& answers);
  bool idle() const { return waiting_.empty(); }

 private:
  struct Question {
    BodyId who;
    std::shared_ptr<const Building> building;
    double floor, height;
    RouteQuery query;
    bool round_agents;
  };
  static constexpr std::size_t kMaxGrids = 8;

  std::vector<std::unique_ptr<RouteGrid>> grids_;  // most recently used last
  std::deque<Question> waiting_;
  std::optional<RouteSearch> search_;  // of the first waiting request
  std::uint32_t searches_ = 0;
  std::shared_ptr<const Building> doors_of_;
  std::vector<const FixedObstacle*> doors_;
};

}  // namespace parhelion::simulation

// Ways for all agents, one search after the other, a bounded piece of them in each step.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "server/simulation/route_search.hpp"

namespace parhelion::simulation {

class Router {
 public:
  /// Cells that searches may take up in a step: some 0.5 ms.
  static constexpr std::size_t kCellsPerStep = 2000;

  struct Answer {
    BodyId who = 0;
    RouteSearch::Result result = RouteSearch::Result::none;
    std::vector<Eigen::Vector2d> points;  ///< m, map, the agent's place first
    bool round_agents = false;            ///< as it was requested
  };

  /// The grid of a floor (to 5 cm) for agents of `height` (to 25 cm), m. Valid until the next call with
  /// another one.
  RouteGrid& grid(const std::shared_ptr<const Building>& building, double floor, double height);
  /// Doors of the building that stand fixed in it, closed.
  const std::vector<const FixedObstacle*>& doors(const std::shared_ptr<const Building>& building);

  /// `who`: an agent's first body; its earlier request is forgotten. `round_agents`: what is blocked holds
  /// others who stand.
  void ask(BodyId who, const std::shared_ptr<const Building>& building, double floor, double height,
           RouteQuery query, bool round_agents);
  void forget(BodyId who);
  /// Goes on with the searches; those that end are appended, in the order of the requests.
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
  static constexpr std::size_t kMostGrids = 8;

  std::vector<std::unique_ptr<RouteGrid>> grids_;  // the one used last at the end
  std::deque<Question> waiting_;
  std::optional<RouteSearch> search_;  // of the first that waits
  std::uint32_t searches_ = 0;
  std::shared_ptr<const Building> doors_of_;
  std::vector<const FixedObstacle*> doors_;
};

}  // namespace parhelion::simulation

// The cheapest way over a RouteGrid, found a little in each step, so that none takes long.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "server/simulation/planar.hpp"
#include "server/simulation/route_grid.hpp"

namespace parhelion::simulation {

struct RouteQuery {
  Eigen::Vector2d start, goal;     ///< m, map
  double clearance = 0.4;          ///< m that the way needs: the agent's radius and a little
  std::vector<Footprint> blocked;  ///< that the way goes round, as the agent's disc
  std::vector<Footprint> doors;    ///< closed, can be pushed open: they cost, and stop nobody
};

/// What a step between two cells costs: ten for each cm of the way, up to twice that near an obstacle (so
/// that ways keep away from walls where there is room), and kDoorCost more in each cell of a closed door.
/// Integers: two searches agree exactly.
struct RouteCost {
  static constexpr double kComfort = 0.35;        ///< m beyond what is needed that counts as near
  static constexpr std::uint32_t kStraight = 10;  ///< 0.1 m
  static constexpr std::uint32_t kDiagonal = 14;
  static constexpr std::uint32_t kDoorCost = 1200;  ///< two or three cells: as long as some 3 m
  static constexpr std::uint32_t kLeast = 10;       ///< factor where nothing is near
  /// Factor of the steps into a cell, 0: cannot be entered.
  static std::uint32_t factor(double clearance, double needed);
};

/// The eight steps, straight ones first.
struct RouteStep {
  std::int32_t x, y;
  std::uint32_t length;
};
inline constexpr std::array<RouteStep, 8> kRouteSteps{{{1, 0, RouteCost::kStraight},
                                                       {0, 1, RouteCost::kStraight},
                                                       {-1, 0, RouteCost::kStraight},
                                                       {0, -1, RouteCost::kStraight},
                                                       {1, 1, RouteCost::kDiagonal},
                                                       {-1, 1, RouteCost::kDiagonal},
                                                       {-1, -1, RouteCost::kDiagonal},
                                                       {1, -1, RouteCost::kDiagonal}}};

/// A* (Hart, Nilsson, Raphael 1968) with the octile distance. One at a time on a grid.
class RouteSearch {
 public:
  enum class Result : std::uint8_t {
    searching,
    found,
    none,       ///< no way leads there
    too_large,  ///< the search came farther than a grid holds
  };
  static constexpr std::size_t kTileWork = 600;  ///< a new tile takes as long as so many cells

  /// `number`: another for each search on the grid, above 0. The start's own cell may be too close to an
  /// obstacle: it leaves by the nearest one that is not, within kLeave.
  RouteSearch(RouteGrid& grid, RouteQuery query, std::uint32_t number);
  static constexpr double kLeave = 0.5;  ///< m

  /// Goes on by about `cells`, and takes what it used from it (it ends at 0 or a little above).
  Result work(std::size_t& cells);
  /// Of the way found: RouteCost units.
  std::uint32_t cost() const { return cost_; }
  /// The way found, through the centres of cells, its ends included as they were requested.
  std::vector<Eigen::Vector2d> cells();
  /// The same with as few corners as leave it free.
  std::vector<Eigen::Vector2d> smooth();
  const RouteQuery& query() const { return query_; }

  /// Factor of the cell, with what is blocked; doors come on top. Shared with the reference implementation.
  std::uint32_t factor(const RouteCell& cell);
  std::uint32_t door_cost(const RouteCell& cell) const;

 private:
  struct Open {
    std::uint32_t estimate, cost;
    RouteCell cell;
  };
  std::uint32_t distance(const RouteCell& cell) const;
  void reach(const RouteCell& cell, std::uint32_t cost, std::uint8_t from);
  void expand(const Open& at);
  bool free_way(const Eigen::Vector2d& from, const Eigen::Vector2d& to);

  RouteGrid& grid_;
  RouteQuery query_;
  std::uint32_t number_;
  RouteCell goal_;
  std::vector<RouteCell> starts_;
  Eigen::AlignedBox2d bounds_;
  std::vector<Open> open_;  // a heap
  Footprint scratch_ = make_disc({0, 0}, 0);
  std::uint32_t cost_ = 0;
  std::size_t made_ = 0;
  bool too_large_ = false;
};

}  // namespace parhelion::simulation

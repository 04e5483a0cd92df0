// The cheapest path over a RouteGrid, searched in small increments per step.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "server/simulation/building/planar.hpp"
#include "server/simulation/building/route_grid.hpp"

namespace parhelion::simulation {

struct RouteQuery {
  Eigen::Vector2d start, goal;     ///< m, map
  double clearance = 0.4;          ///< m required: the agent's radius plus a margin
  std::vector<Footprint> blocked;  ///< areas to avoid, grown by the agent's disc
  std::vector<Footprint> doors;    ///< closed, can be pushed open: at extra cost
};

/// Cost of a step between two cells: ten for each cm, up to twice that near an obstacle (so that paths
/// keep away from walls where possible), and kDoorCost in addition for each cell of a closed door. Integers,
/// so that two searches agree exactly.
struct RouteCost {
  static constexpr double kComfort = 0.35;        ///< m beyond the required clearance that counts as near
  static constexpr std::uint32_t kStraight = 10;  ///< 0.1 m
  static constexpr std::uint32_t kDiagonal = 14;
  static constexpr std::uint32_t kDoorCost = 1200;  ///< two or three cells: equivalent to about 3 m
  static constexpr std::uint32_t kMinFactor = 10;   ///< factor without obstacles nearby
  /// Factor for steps into a cell; 0: blocked.
  static std::uint32_t factor(double clearance, double needed);
};

/// The eight directions, straight ones first.
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

/// A* (Hart, Nilsson, Raphael 1968) with the octile distance. One at a time per grid.
class RouteSearch {
 public:
  enum class Result : std::uint8_t {
    searching,
    found,
    none,       ///< there is no path
    too_large,  ///< the search exceeded the grid's limit
  };
  static constexpr std::size_t kTileWork = 600;  ///< cost of a new tile, in cells

  /// `number`: unique for each search on the grid, above 0. The start's own cell may be too close to an
  /// obstacle: the path then leaves by the nearest free cell within kLeave.
  RouteSearch(RouteGrid& grid, RouteQuery query, std::uint32_t number);
  static constexpr double kLeave = 0.5;  ///< m

  /// Continues for about `cells`, and subtracts the work done (down to 0; may exceed it slightly).
  Result work(std::size_t& cells);
  /// Cost of the path found, in RouteCost units.
  std::uint32_t cost() const { return cost_; }
  /// The path found, through cell centres, with the requested end points.
  std::vector<Eigen::Vector2d> cells();
  /// The same with as few corners as possible.
  std::vector<Eigen::Vector2d> smooth();
  const RouteQuery& query() const { return query_; }

  /// Factor of the cell, including blocked areas but not doors. Shared with the reference implementation.
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
  bool has_free_path(const Eigen::Vector2d& from, const Eigen::Vector2d& to);

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

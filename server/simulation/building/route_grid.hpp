// Free space on a floor of the building: a grid of clearances, computed tile by tile as a search needs them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "server/simulation/building/building.hpp"

namespace parhelion::simulation {

/// A cell, counted from the map's origin.
struct RouteCell {
  std::int32_t x = 0, y = 0;
  bool operator==(const RouteCell&) const = default;
};

/// The building without its doors, between `floor` + kOverFloor and `floor` + `height`.
class RouteGrid {
 public:
  static constexpr double kCell = 0.1;          ///< m
  static constexpr double kMaxClearance = 1.0;  ///< m: larger clearances are clamped
  static constexpr double kOverFloor = 0.05;    ///< m: lower obstacles are driven over
  static constexpr std::int32_t kTile = 32;     ///< cells along the side of a tile
  static constexpr std::size_t kMaxTiles = 4096;

  /// A search's state of a cell. Valid if `search` is its number.
  struct Node {
    std::uint32_t search = 0;
    std::uint32_t cost = 0;
    std::uint8_t from = 0;  ///< incoming direction
    bool closed = false;
  };
  struct Tile {
    std::array<float, std::size_t{kTile} * kTile> clearance;
    std::array<Node, std::size_t{kTile} * kTile> nodes;
  };
  struct Place {
    float clearance;
    Node* node;
  };

  RouteGrid(std::shared_ptr<const Building> building, double floor, double height)
      : building_(std::move(building)), bottom_(floor + kOverFloor), top_(floor + height) {}

  static RouteCell cell_of(const Eigen::Vector2d& p);
  static Eigen::Vector2d center(const RouteCell& cell);

  /// Clearance of the cell's centre and the cell's node; nullptr for the node beyond kMaxTiles. New tiles
  /// are counted in `made`.
  Place at(const RouteCell& cell, std::size_t& made);

  /// m from p to the nearest obstacle, at most kMaxClearance; negative inside one. Exact.
  double clearance(const Eigen::Vector2d& p);
  /// Straight distance in the unit `direction` with this clearance, at most `limit`, m.
  double free_distance(const Eigen::Vector2d& from, const Eigen::Vector2d& direction, double limit,
                       double clearance);
  /// Whether each point of the segment has at least `clearance` (m; up to 1 mm less), by advancement.
  bool free_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double clearance);

  /// Extent of the building.
  const Eigen::AlignedBox2d& extent() const { return building_->extent(); }
  bool is_of(const std::shared_ptr<const Building>& building, double floor, double height) const {
    return building == building_ && floor + kOverFloor == bottom_ && floor + height == top_;
  }

 private:
  Tile* make(const RouteCell& tile);
  /// m along a ray to its first point with less clearance; none within `limit`.
  std::optional<double> first_too_close(const Eigen::Vector2d& from, const Eigen::Vector2d& direction,
                                        double limit, double needed);

  std::shared_ptr<const Building> building_;
  double bottom_, top_;
  std::unordered_map<std::uint64_t, std::unique_ptr<Tile>> tiles_;  // only for look-up, never iterated
  std::uint64_t newest_key_ = 0;
  Tile* newest_ = nullptr;
  std::vector<const FixedObstacle*> near_;
};

}  // namespace parhelion::simulation

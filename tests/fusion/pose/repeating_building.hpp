// Buildings of 50 m x 20 m in which many places look alike: a corridor with eleven rooms on each side, most
// of them offices of one size, half of these with the same furniture. Places change after the map was made.
#pragma once

#include <array>

#include "protocols/nearest_on_segment.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::test {

struct Room {
  Eigen::Vector2d low, high;        ///< m, corners
  Eigen::Vector2d inside, outside;  ///< before and behind its doorway; the corridor has none
  bool open = true;                 ///< its door, when the robot drives
};

struct RepeatingBuilding {
  TrueBuilding walls;
  std::vector<Room> rooms;  ///< the last one is the corridor
};

struct BuildingOptions {
  double moved = 0;        ///< fraction of the furniture that stands elsewhere when the robot drives
  double doors = 0;        ///< fraction of the doors that are open instead of shut, or the other way round
  int cupboards = 0;       ///< in each room, and twice as many in the corridor, that are not in the map
  double alike = 0.5;      ///< fraction of the offices that have the same furniture when mapped
  bool symmetric = false;  ///< the map looks the same when turned by 180 degrees
};

namespace building {

constexpr double kLength = 50, kDepth = 20, kNear = 9,
                 kFar = 11;  ///< m; the corridor is between the last two

struct Piece {
  Eigen::Vector2d centre, size;
  double yaw;
};

/// From a room's own frame, whose x axis lies along the wall opposite the door, to the building's.
struct Placement {
  double x, width;
  bool north;

  Eigen::Vector2d operator()(const Eigen::Vector2d& p) const {
    return north ? Eigen::Vector2d(x + width - p.x(), kDepth - p.y()) : Eigen::Vector2d(x + p.x(), p.y());
  }
};

inline Piece random_piece(double width, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Eigen::Vector2d size(0.4 + 0.9 * unit(random), 0.3 + 0.4 * unit(random));
  return {{0.7 + (width - 1.4) * unit(random), 0.6 + (kNear - 2.6) * unit(random)}, size, 3 * unit(random)};
}

inline void add_piece(std::vector<Segment>& walls, const Placement& place, const Piece& piece) {
  add_turned_box(walls, place(piece.centre), piece.size, piece.yaw);
}

/// Widths from west to east: nine offices of 4 m and two rooms of other sizes.
inline std::array<double, 11> widths(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::array<double, 11> result;
  result.fill(4);
  const double one = 5.5 + 3 * unit(random);
  result[random() % 5] = one;
  result[5 + random() % 6] = 14 - one;
  return result;
}

/// The furniture of a room when mapped and now, and things that have come since.
inline void furnish(TrueBuilding& walls, const Placement& place, const std::vector<Piece>& pieces,
                    const BuildingOptions& options, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Piece& piece : pieces) {
    add_piece(walls.mapped, place, piece);
    add_piece(walls.now, place, unit(random) < options.moved ? random_piece(place.width, random) : piece);
  }
  for (int i = 0; i < options.cupboards; ++i) {
    Piece cupboard = random_piece(place.width, random);
    cupboard.size = {1 + 0.8 * unit(random), 0.6};
    add_piece(walls.now, place, cupboard);
  }
}

inline void add_wall(TrueBuilding& walls, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  walls.mapped.push_back({a, b});
  walls.now.push_back({a, b});
}

/// A door's leaf, hinged at one side of a doorway of 1 m at `x` of the room.
inline Segment leaf(const Placement& place, double x, bool open) {
  return {place({x, kNear}),
          place(open ? Eigen::Vector2d(x + 0.17, kNear - 0.98) : Eigen::Vector2d(x + 1, kNear))};
}

inline Room add_room(TrueBuilding& walls, const Placement& place, bool shut, const BuildingOptions& options,
                     std::mt19937& random) {
  constexpr double door = 1.2;
  std::uniform_real_distribution<double> unit(0, 1);
  add_wall(walls, place({0, kNear}), place({door, kNear}));
  add_wall(walls, place({door + 1, kNear}), place({place.width, kNear}));
  add_wall(walls, place({place.width, 0}), place({place.width, kNear}));
  const bool open = unit(random) < options.doors ? shut : !shut;
  walls.mapped.push_back(leaf(place, door, !shut));
  walls.now.push_back(leaf(place, door, open));
  const Eigen::Vector2d a = place({0, 0}), b = place({place.width, kNear});
  return {a.cwiseMin(b), a.cwiseMax(b), place({door + 0.6, kNear - 1.2}), place({door + 0.6, kNear + 1}),
          open};
}

inline double clearance(const std::vector<Segment>& walls, const Eigen::Vector2d& p) {
  double nearest = 1e9;
  for (const Segment& wall : walls) {
    nearest = std::min(nearest, (nearest_on_segment(p, wall.a, wall.b) - p).norm());
  }
  return nearest;
}

inline bool is_free(const std::vector<Segment>& walls, const Eigen::Vector2d& from,
                    const Eigen::Vector2d& to) {
  constexpr double step = 0.15, radius = 0.3;
  const double length = (to - from).norm();
  for (double s = 0; s <= length; s += step) {
    if (clearance(walls, from + (to - from) * (s / std::max(length, step))) < radius) return false;
  }
  return true;
}

inline Eigen::Vector2d somewhere(const Room& room, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Eigen::Vector2d margin(0.5, 0.5), size = room.high - room.low - 2 * margin;
  return room.low + margin + Eigen::Vector2d(size.x() * unit(random), size.y() * unit(random));
}

/// Where a robot has room to stand.
inline Eigen::Vector2d free_place(const std::vector<Segment>& walls, const Room& room, std::mt19937& random) {
  for (int tries = 0; tries < 1000; ++tries) {
    const Eigen::Vector2d p = somewhere(room, random);
    if (clearance(walls, p) > 0.4) return p;
  }
  return room.inside;
}

/// Adds up to `count` places of the room, each straight ahead from the one before.
inline void roam(std::vector<Eigen::Vector2d>& route, const std::vector<Segment>& walls, const Room& room,
                 int count, std::mt19937& random) {
  for (int tries = 0; tries < 60 && count > 0; ++tries) {
    const Eigen::Vector2d p = free_place(walls, room, random);
    if ((p - route.back()).norm() < 0.5 || !is_free(walls, route.back(), p)) continue;
    route.push_back(p);
    --count;
  }
}

/// Into each room and out again.
inline std::vector<Eigen::Vector2d> mapping_route(const RepeatingBuilding& building, std::mt19937& random) {
  std::vector<const Room*> rooms;
  for (std::size_t i = 0; i + 1 < building.rooms.size(); ++i) rooms.push_back(&building.rooms[i]);
  std::stable_sort(rooms.begin(), rooms.end(),
                   [](const Room* a, const Room* b) { return a->outside.x() < b->outside.x(); });
  std::vector<Eigen::Vector2d> route{{1, 10}};
  for (const Room* room : rooms) {
    route.emplace_back(room->outside.x(), 10);
    route.push_back(room->inside);
    roam(route, building.walls.mapped, *room, 3, random);
    route.push_back(room->inside);
    route.emplace_back(room->outside.x(), 10);
  }
  route.emplace_back(49, 10);
  route.emplace_back(1, 10);
  return route;
}

}  // namespace building

inline RepeatingBuilding repeating_building(std::uint32_t seed, const BuildingOptions& options = {}) {
  using namespace building;
  std::mt19937 layout(seed), changes(seed + 1000);  // the map does not depend on what changes
  RepeatingBuilding result;
  TrueBuilding& walls = result.walls;
  add_box(walls.mapped, 0, 0, kLength, kDepth);
  add_box(walls.now, 0, 0, kLength, kDepth);
  std::vector<Piece> usual;
  for (int i = 0; i < 5; ++i) usual.push_back(random_piece(4, layout));
  for (const bool north : {false, true}) {
    // Turned by 180 degrees, the north side of a symmetric building is its south side.
    std::mt19937 side(seed + (north && !options.symmetric ? 2000 : 3000));
    double x = 0;
    for (const double width : widths(side)) {
      const Placement place{north ? kLength - x - width : x, width, north};
      const bool alike = width == 4 && static_cast<double>(side() % 100) < 100 * options.alike,
                 shut = side() % 10 < 3;
      std::vector<Piece> pieces = usual;
      for (Piece& piece : pieces) {
        const Piece other = random_piece(width, side);
        if (!alike) piece = other;
      }
      result.rooms.push_back(add_room(walls, place, shut, options, changes));
      furnish(walls, place, pieces, options, changes);
      x += width;
    }
  }
  result.rooms.push_back({{0, kNear}, {kLength, kFar}, {25, 10}, {25, 10}, true});
  for (int i = 0; i < 2 * options.cupboards; ++i) {
    const double x = 2 + 46 * (static_cast<double>(changes() % 1000) / 1000);
    const double y = changes() % 2 == 0 ? kNear : kFar - 0.4;
    add_box(walls.now, x, y, x + 1.2, y + 0.4);
  }
  walls.route = mapping_route(result, layout);
  return result;
}

}  // namespace parhelion::test

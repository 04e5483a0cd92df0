// A large building of long corridors that cross, and drives around its rings: what mapping finds hardest.
// Doors are alike, so that a scan fits at many places along a corridor, and hundreds of metres lie between
// two visits.
#pragma once

#include "tests/fusion/pose/trajectory_error.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::test {

struct CorridorOptions {
  std::uint32_t seed = 1;
  std::vector<double> xs{0, 60, 120}, ys{0, 40};  ///< m, middle lines of the corridors
  double width = 2.2;                             ///< m
  bool alike = false;                             ///< all rooms are 4 m wide, with the door at the same place
  double shut = 0.6;                              ///< fraction of the doors
  double clutter = 0.06;                          ///< things that stand in the corridor, per metre
};

namespace corridors {

/// One side of a corridor, from end to end, with rooms behind it. `outward`: unit vector.
struct Side {
  Eigen::Vector2d begin, end, outward;
};

/// A door of 0.9 m in a recess of 0.12 m; behind an open one a furnished room, 5 m deep.
inline void add_room(std::vector<Segment>& walls, const Side& side, double from, double width,
                     const CorridorOptions& options, std::mt19937& random) {
  constexpr double door_width = 0.9, recess = 0.12, depth = 5;
  std::uniform_real_distribution<double> unit(0, 1);
  const Eigen::Vector2d along = (side.end - side.begin).normalized();
  const auto at = [&](double s, double out) {
    return Eigen::Vector2d(side.begin + along * (from + s) + side.outward * out);
  };
  if (width < 1.6) {
    walls.push_back({at(0, 0), at(width, 0)});
    return;
  }
  const double door = options.alike ? std::min(1.2, width - 1) : 0.3 + (width - 1.5) * unit(random);
  walls.push_back({at(0, 0), at(door, 0)});
  walls.push_back({at(door + door_width, 0), at(width, 0)});
  for (const double edge : {door, door + door_width}) walls.push_back({at(edge, 0), at(edge, recess)});
  if (unit(random) < options.shut) {
    walls.push_back({at(door, recess), at(door + door_width, recess)});
  } else {
    walls.push_back({at(door, recess), at(door + 0.1, recess + 0.86)});  // its leaf
    walls.push_back({at(0, recess), at(0, depth)});
    walls.push_back({at(width, recess), at(width, depth)});
    walls.push_back({at(0, depth), at(width, depth)});
    for (int piece = 0; piece < 3; ++piece) {
      const Eigen::Vector2d centre = at(0.6 + (width - 1.2) * unit(random), 1.6 + 3 * unit(random));
      const Eigen::Vector2d size(0.4 + 0.9 * unit(random), 0.3 + 0.4 * unit(random));
      add_turned_box(walls, centre, size, 3 * unit(random));
    }
  }
  if (unit(random) < options.clutter * width) {
    const Eigen::Vector2d centre = at(width * unit(random), -0.2);
    add_turned_box(walls, centre, {0.3 + 0.6 * unit(random), 0.3}, std::atan2(along.y(), along.x()));
  }
}

inline void add_side(std::vector<Segment>& walls, const Side& side, const CorridorOptions& options,
                     std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double length = (side.end - side.begin).norm();
  for (double from = 0; from < length - 1e-9;) {
    double width = options.alike ? 4 : 3 + 4 * unit(random);
    if (length - from < width + 2.5) width = length - from;
    add_room(walls, side, from, width, options, random);
    from += width;
  }
}

/// The sides of the corridors along one axis.
inline void add_parallel(std::vector<Segment>& walls, const std::vector<double>& across,
                         const std::vector<double>& crossings, bool along_y, const CorridorOptions& options,
                         std::mt19937& random) {
  const double half = options.width / 2;
  const auto place = [&](double s, double t) {
    return along_y ? Eigen::Vector2d(t, s) : Eigen::Vector2d(s, t);
  };
  for (std::size_t j = 0; j < across.size(); ++j) {
    for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
      for (const double side : {-1.0, 1.0}) {
        const bool outer = (j == 0 && side < 0) || (j + 1 == across.size() && side > 0);
        const bool first = i == 0, last = i + 2 == crossings.size();
        // An outer wall goes on past the crossings, and around the corner.
        const double begin = crossings[i] + (outer ? (first ? -half : 0) : half),
                     end = crossings[i + 1] + (outer ? (last ? half : 0) : -half);
        const double t = across[j] + side * half;
        add_side(walls, {place(begin, t), place(end, t), place(0, side)}, options, random);
      }
    }
  }
}

}  // namespace corridors

/// Without a route.
inline TrueBuilding corridor_building(const CorridorOptions& options) {
  std::mt19937 random(options.seed);
  TrueBuilding building;
  corridors::add_parallel(building.mapped, options.ys, options.xs, false, options, random);
  corridors::add_parallel(building.mapped, options.xs, options.ys, true, options, random);
  building.now = building.mapped;
  return building;
}

/// Pairs of scans as Kuemmerle et al. (2009) compare them: 3 m of path apart, and at places that were visited
/// before, at most 2 m and at least 20 m of path away.
struct TrueRelations {
  std::vector<Relation> near, loops;
};

inline TrueRelations true_relations(const TrueDrive& drive) {
  struct Visit {
    double driven;
    const TrueScan* scan;
  };
  std::vector<Visit> visits;  // each metre
  double driven = 0;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const TrueScan& scan = drive.scans[i];
    if (i > 0) driven += (scan.T_map_base.position() - drive.scans[i - 1].T_map_base.position()).norm();
    if (visits.empty() || driven >= visits.back().driven + 1) visits.push_back({driven, &scan});
  }
  const auto relation = [](const Visit& a, const Visit& b) {
    return Relation{a.scan->scan.stamp, b.scan->scan.stamp,
                    a.scan->T_map_base.inverse() * b.scan->T_map_base};
  };
  TrueRelations result;
  for (std::size_t k = 3; k < visits.size(); ++k) {
    result.near.push_back(relation(visits[k - 3], visits[k]));
    const Eigen::Vector2d here = visits[k].scan->T_map_base.position();
    const auto away = [&](const Visit& visit) { return (visit.scan->T_map_base.position() - here).norm(); };
    const Visit* nearest = nullptr;
    for (const Visit& before : visits) {
      if (visits[k].driven - before.driven < 20) break;
      if (away(before) < (nearest == nullptr ? 2 : away(*nearest))) nearest = &before;
    }
    if (nearest != nullptr) result.loops.push_back(relation(*nearest, visits[k]));
  }
  return result;
}

}  // namespace parhelion::test

#include "tests/loop/site.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "protocols/nearest_on_segment.hpp"

namespace parhelion::test {
namespace {

constexpr double kWall = 0.1;  // m, thickness
constexpr double kQuarter = std::numbers::pi / 2;

/// Signed distance from p to a rectangle or a disc; negative inside.
double distance_to(const Pose2& T_map_piece, double size_x, double size_y, bool round,
                   const Eigen::Vector2d& p_map) {
  const Eigen::Vector2d p = (T_map_piece.inverse() * p_map).cwiseAbs();
  if (round) return p.norm() - size_x / 2;
  const Eigen::Vector2d d = p - Eigen::Vector2d(size_x, size_y) / 2;
  return d.cwiseMax(0).norm() + std::min(0.0, d.maxCoeff());
}

struct Slab {
  const char* name;
  Pose2 pose;     ///< x along it
  double length;  ///< m
};

std::vector<Slab> walls(const Site& s) {
  const double low = s.door_low, high = s.door_low + s.door_width;
  return {{"wall 1", {s.length / 2, 0, 0}, s.length - kWall},
          {"wall 2", {s.length / 2, s.width, 0}, s.length - kWall},
          {"wall 3", {0, s.width / 2, kQuarter}, s.width - kWall},
          {"wall 4", {s.length, s.width / 2, kQuarter}, s.width - kWall},
          {"wall 5", {s.partition, (low + kWall / 2) / 2, kQuarter}, low - kWall / 2},
          {"wall 6", {s.partition, (high + s.width - kWall / 2) / 2, kQuarter}, s.width - kWall / 2 - high}};
}

Slab closed_door(const Site& s) {
  return {"door 1", {s.partition, s.door_low + s.door_width / 2, kQuarter}, s.door_width};
}

/// Along the upper or the lower wall of a room, and perhaps pushed along it since.
Site::Piece by_the_wall(Draw& draw, double from, double to, bool upper, double width) {
  Site::Piece piece;
  piece.size_x = draw.within(0.6, 1.4), piece.size_y = draw.within(0.3, 0.5);
  piece.height = draw.within(0.7, 1.9);
  const double low = from + piece.size_x / 2 + 0.1, high = to - piece.size_x / 2 - 0.1;
  const double off = kWall / 2 + piece.size_y / 2 + 0.02, y = upper ? width - off : off;
  piece.surveyed = piece.now = {draw.within(low, high), y, 0};
  if (draw.chance(0.6)) piece.now.x = draw.within(low, high);
  return piece;
}

double distance_to_line(const std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& p) {
  double nearest = 1e9;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    nearest = std::min(nearest, (nearest_on_segment(p, line[i], line[i + 1]) - p).norm());
  }
  return nearest;
}

std::vector<Eigen::Vector2d> whole_route(const Site& site) {
  std::vector<Eigen::Vector2d> line{site.start.position()};
  line.insert(line.end(), site.route.begin(), site.route.end());
  return line;
}

/// A chair or a box that somebody left, where the robot can still pass.
void leave_something(Draw& draw, Site& site) {
  for (int tries = 0; tries < 200; ++tries) {
    Site::Piece piece;
    piece.round = draw.chance(0.5), piece.was_there = false;
    piece.size_x = draw.within(0.25, 0.45), piece.size_y = piece.size_x, piece.height = draw.within(0.5, 1);
    piece.now = {draw.within(0.8, site.length - 0.8), draw.within(0.8, site.width - 0.8), draw.within(0, 3)};
    const Eigen::Vector2d p = piece.now.position();
    const double off = distance_to_line(whole_route(site), p);
    const Eigen::Vector2d door(site.partition, site.door_low + site.door_width / 2);
    if (off < 0.45 || (p - door).norm() < 1.6 || (p - site.start.position()).norm() < 1 ||
        (p - site.route.back()).norm() < 0.9 || distance_to_line(site.other_route, p) < 0.8 ||
        clearance(site, p) < 0.5)
      continue;
    site.furniture.push_back(piece);
    return;
  }
}

}  // namespace

Site make_site(std::uint64_t seed) {
  Draw draw(seed * 7919 + 1);
  Site s;
  s.seed = seed;
  s.length = draw.within(8, 9.5), s.width = draw.within(4.8, 5.8);
  s.partition = s.length * draw.within(0.42, 0.5);
  s.door_width = draw.within(1.1, 1.3), s.door_low = draw.within(1.4, s.width - 1.4 - s.door_width);
  s.door_angle = draw.within(1.4, 1.65);
  s.start = {1.0, draw.within(1.4, s.width - 1.4), draw.within(-0.3, 0.3)};
  const double door = s.door_low + s.door_width / 2 - 0.08;  // off the leaf
  s.route = {{s.partition - 0.8, door},
             {s.partition + 0.9, door - 0.1},
             {s.length - draw.within(1.0, 1.3), draw.within(1.4, s.width - 1.4)}};
  // The other robot crosses the second room, in front of the goal.
  const double x = s.length - draw.within(2.0, 2.4);
  const bool up = draw.chance(0.5);
  s.other_start = {x, up ? 1.0 : s.width - 1.0, up ? kQuarter : -kQuarter};
  s.other_route = {s.other_start.position(), {x - 0.1, up ? s.width - 1.1 : 1.1}};
  for (const auto& [from, to] :
       {std::pair(0.1, s.partition - 0.6), std::pair(s.partition + 1.5, s.length - 0.1)}) {
    for (const bool upper : {false, true}) s.furniture.push_back(by_the_wall(draw, from, to, upper, s.width));
  }
  for (int i = 0; i < 2; ++i) leave_something(draw, s);
  return s;
}

double clearance(const Site& site, const Eigen::Vector2d& p) {
  double nearest = 1e9;
  for (const Slab& wall : walls(site))
    nearest = std::min(nearest, distance_to(wall.pose, wall.length, kWall, false, p));
  for (const Site::Piece& piece : site.furniture) {
    nearest = std::min(nearest, distance_to(piece.now, piece.size_x, piece.size_y, piece.round, p));
    if (piece.was_there)
      nearest = std::min(nearest, distance_to(piece.surveyed, piece.size_x, piece.size_y, piece.round, p));
  }
  return nearest;
}

/// Surfaces at the laser's height are occupied, what they enclose is unknown.
pose::GridMap survey_map(const Site& site) {
  pose::GridMap map;
  map.resolution = 0.025;
  map.x_min = map.y_min = -0.5;
  map.width = static_cast<int>((site.length + 1) / map.resolution);
  map.height = static_cast<int>((site.width + 1) / map.resolution);
  std::vector<Slab> slabs = walls(site);
  slabs.push_back(closed_door(site));
  for (int row = 0; row < map.height; ++row) {
    for (int column = 0; column < map.width; ++column) {
      const Eigen::Vector2d p(map.x_min + (column + 0.5) * map.resolution,
                              map.y_min + (row + 0.5) * map.resolution);
      double nearest = 1e9;
      for (const Slab& slab : slabs)
        nearest = std::min(nearest, distance_to(slab.pose, slab.length, kWall, false, p));
      for (const Site::Piece& piece : site.furniture) {
        if (piece.was_there)
          nearest =
              std::min(nearest, distance_to(piece.surveyed, piece.size_x, piece.size_y, piece.round, p));
      }
      const bool indoors = p.x() > 0 && p.y() > 0 && p.x() < site.length && p.y() < site.width;
      const bool surface = indoors && std::abs(nearest) <= map.resolution / 2;
      map.occupied.push_back(surface ? 1.0F : indoors && nearest > 0 ? 0.0F : 0.5F);
    }
  }
  map.id = pose::grid_map_id(map);
  return map;
}

SemanticModel survey_model(const Site& site, const std::string& map_id) {
  SemanticModel model;
  model.map_id = map_id;
  const auto add = [&](const std::string& name, EntityLabel label, const Pose2& pose,
                       const Eigen::Vector3d& size) {
    ModelEntity entity;
    entity.name = name, entity.label = label, entity.size = size;
    entity.T_map_body = Transform<Map, Body>::planar(pose.x, pose.y, pose.yaw, size.z() / 2);
    model.entities.push_back(entity);
  };
  for (const Slab& wall : walls(site))
    add(wall.name, EntityLabel::wall, wall.pose, {wall.length, kWall, 2.5});
  const Slab door = closed_door(site);
  add(door.name, EntityLabel::door, door.pose, {door.length, 0.04, 2.0});
  model.entities.back().hinge = Hinge{.axis = {door.length / 2, 0}, .lower = 0, .upper = 1.9};
  int number = 0;
  for (const Site::Piece& piece : site.furniture) {
    if (piece.was_there)
      add("furniture " + std::to_string(++number), EntityLabel::unknown, piece.surveyed,
          {piece.size_x, piece.size_y, piece.height});
  }
  return model;
}

std::string true_building(const Site& s) {
  std::string text;
  const auto line = [&](const char* format, auto... values) {
    char buffer[200];
    std::snprintf(buffer, sizeof buffer, format, values...);
    text += buffer;
  };
  const double low = s.door_low, high = s.door_low + s.door_width;
  line("start %.4f %.4f %.4f\n", s.start.x, s.start.y, s.start.yaw);
  // Walls from corner to corner: not the survey's pieces.
  line("wall 0 0 %.4f 0 0.1 0 2.5 214 208 196\n", s.length);
  line("wall %.4f 0 %.4f %.4f 0.1 0 2.5 200 196 186\n", s.length, s.length, s.width);
  line("wall %.4f %.4f 0 %.4f 0.1 0 2.5 214 208 196\n", s.length, s.width, s.width);
  line("wall 0 %.4f 0 0 0.1 0 2.5 200 196 186\n", s.width);
  line("wall %.4f 0 %.4f %.4f 0.1 0 2.5 206 214 214\n", s.partition, s.partition, low);
  line("wall %.4f %.4f %.4f %.4f 0.1 0 2.5 206 214 214\n", s.partition, high, s.partition, s.width);
  line("wall %.4f %.4f %.4f %.4f 0.04 0 2 150 110 70\n", s.partition, high,
       s.partition + s.door_width * std::sin(s.door_angle), high - s.door_width * std::cos(s.door_angle));
  for (const Site::Piece& piece : s.furniture) {
    if (piece.round)
      line("post %.4f %.4f %.4f 0 %.4f 60 70 90\n", piece.now.x, piece.now.y, piece.size_x / 2, piece.height);
    else
      line("box %.4f %.4f %.4f %.4f %.4f 0 %.4f 140 100 60\n", piece.now.x, piece.now.y, piece.now.yaw,
           piece.size_x, piece.size_y, piece.height);
  }
  return text;
}

}  // namespace parhelion::test

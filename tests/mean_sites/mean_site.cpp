#include "tests/mean_sites/mean_site.hpp"

#include <algorithm>
#include <cmath>

#include "tests/mean_sites/kinds/kinds.hpp"

namespace parhelion::test {
namespace {

using L = EntityLabel;

void slab(SitePen& pen, double x0, double y0, double x1, double y1, double height) {
  pen.box(L::floor, {x0, y0, -0.2}, {x1, y1, 0});
  if (height > 0) pen.box(L::ceiling, {x0, y0, height}, {x1, y1, height + 0.2});
  pen.site().ceiling = height > 0;
}

/// A camera carried around a room, 1.4 m up.
void walk(SitePen& pen, double x0, double y0, double x1, double y1) {
  for (int k = 0; k < 16; ++k) {
    const double a = 2 * EIGEN_PI * k / 16;
    pen.site().path.emplace_back(0.5 * (x0 + x1) + 0.25 * (x1 - x0) * std::cos(a),
                                 0.5 * (y0 + y1) + 0.25 * (y1 - y0) * std::sin(a), 1.4);
  }
}

/// Persons, bins and boxes anywhere on a floor, where things are varied.
void scatter(SitePen& pen, double x0, double y0, double x1, double y1, double z = 0) {
  if (!pen.varied()) return;
  const auto place = [&] { return Eigen::Vector3d(pen.shape(x0, x1, 0), pen.shape(y0, y1, 0), z); };
  for (int k = 0; k < 3; ++k) pen.person(place(), static_cast<int>(pen.shape(0, 4, 0)));
  const double bin = pen.shape(0.2, 0.4, 0), size = pen.shape(0.3, 1.1, 0);
  pen.solid("bin", place(), 0, {bin, bin, pen.shape(0.3, 0.8, 0)});
  pen.solid("box", place(), 0, {size, pen.shape(0.25, 1.0, 0), pen.shape(0.2, 1.1, 0)});
}

/// Chairs around a table that may fill what a scanner sees of the floor.
void dining(SitePen& pen, const Eigen::Vector3d& at) {
  const double along = pen.range(1.2, 2.6), deep = pen.range(0.7, 1.3);
  const int turned = pen.whole(0, 1);
  pen.table(at, turned, along, deep, pen.range(0.70, 0.78));
  for (const double side : {-1.0, 1.0}) {
    for (const double s : {-0.3, 0.3}) {
      if (!pen.chance(0.75)) continue;
      const Eigen::Vector2d p(s * along, side * (deep / 2 + pen.range(0.1, 0.3)));
      const Eigen::Vector2d q = turned == 0 ? p : Eigen::Vector2d(-p.y(), p.x());
      pen.chair(at + Eigen::Vector3d(q.x(), q.y(), 0), (side > 0 ? 0 : 2) + turned);
    }
  }
}

/// One open room with a bathroom in a corner; a bar counter in line with the bathroom's wall, a wardrobe up
/// to the ceiling, a bed, a kitchen, glass.
MeanSite flat(SitePen& pen) {
  const double w = pen.range(8, 11), d = pen.range(6, 8), h = pen.range(2.4, 2.9);
  slab(pen, -0.2, -0.2, w + 0.2, d + 0.2, h);
  pen.wall_with_door({-0.06, 0}, {-0.06, d}, 0, h, pen.range(0.4, 1.0), 0.9);
  pen.wall({w + 0.06, 0}, {w + 0.06, d}, 0, h);
  pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, 0, h);
  // A window over a sill in the long wall.
  const double from = pen.range(3.0, 4.0), to = from + pen.range(1.2, 2.2);
  pen.wall({-0.12, d + 0.06}, {from, d + 0.06}, 0, h);
  pen.wall({to, d + 0.06}, {w + 0.12, d + 0.06}, 0, h);
  pen.wall({from, d + 0.06}, {to, d + 0.06}, 0, 0.95);
  pen.wall({from, d + 0.06}, {to, d + 0.06}, 2.1, h);
  const double bx = pen.range(2.0, 2.6), by = pen.range(1.8, 2.4);  // the bathroom's size
  pen.wall({w - bx, d}, {w - bx, d - by}, 0, h);
  pen.wall_with_door({w - bx - 0.06, d - by}, {w, d - by}, 0, h, pen.range(0.3, 0.6), 0.8);
  pen.solid("cupboard", {w - 0.3, d - 0.6, 0}, 0, {0.5, 0.9, pen.range(0.8, 0.9)});
  // In line with the bathroom's wall: a counter across the open room, a gap of 0.7 to 2 m between them.
  const double high = pen.range(0.88, 1.12), gap = pen.range(0.7, 2.0), along = pen.range(1.8, 3.0);
  pen.solid("counter", {w - bx - gap - along / 2, d - by + pen.range(-0.02, 0.02), 0}, 0,
            {along, 0.45, high});
  for (double x = w - bx - gap - along + 0.4; x < w - bx - gap; x += 0.7)
    pen.solid("chair", {x, d - by - 0.5, 0}, 0, {0.35, 0.35, pen.range(0.6, 0.7)});
  // The kitchen: low cupboards, and others that hang over them.
  const double k = pen.range(2.0, 2.6);
  pen.solid("counter", {w - 0.3, k / 2 + 0.2, 0}, 0, {0.6, k, 0.9});
  pen.solid("cupboard", {w - 0.18, k / 2 + 0.2, 1.45}, 0, {0.36, k, pen.range(0.6, 0.8)});
  pen.solid("cupboard", {w - 0.35, k + 0.55, 0}, 0, {0.7, 0.65, pen.chance(0.5) ? h - 0.01 : 1.9});
  dining(pen, {w - 2.6, pen.range(1.5, 2.0), 0});
  pen.bed({1.6, d - 1.15, 0}, 0);
  pen.solid("cupboard", {0.3, d - 2.6 - 0.6, 0}, 0, {0.6, pen.range(1.2, 2.0), pen.chance(0.6) ? h : 2.1});
  pen.sofa({3.2, pen.range(0.7, 1.0), 0}, 2, pen.range(1.5, 2.2));
  pen.table({3.2, 2.3, 0}, 0, 1.0, 0.6, pen.range(0.38, 0.48));
  if (pen.chance(0.7)) pen.shelf({1.4, 0.16, 0}, 2, 1.2, pen.range(1.2, 2.1));
  if (pen.chance(0.7)) pen.plant({5.2, 0.5, 0});
  if (pen.chance(0.5)) pen.solid("bin", {5.2, d - 0.35, 0}, 0, {0.3, 0.3, 0.5});
  scatter(pen, 0.8, 0.8, w - 0.8, d - 0.8);
  pen.stand({pen.range(4.0, 5.0), pen.range(2.7, 3.2), pen.range(1.1, 1.6)});
  pen.stand({w - 1.6, d - by - 1.1, pen.range(1.1, 1.6)});
  pen.stand({w - bx / 2, d - by / 2, pen.range(1.1, 1.5)});
  if (pen.chance(0.6)) pen.stand({3.4, d - 1.4, pen.range(1.1, 1.6)});
  walk(pen, 0.5, 0.5, w - bx, d - by);
  return std::move(pen.site());
}

/// A storey high flight, straight or with a landing, in a hall; seen from below, from above or from its side.
MeanSite stair_hall(SitePen& pen) {
  const int steps = pen.whole(9, 17);
  const double rise = pen.range(0.15, 0.19), tread = pen.range(0.26, 0.31), wide = pen.range(1.2, 2.4);
  const bool landing = pen.chance(0.5);
  const double flat_piece = landing ? pen.range(1.0, 1.5) : 0;
  const double run = steps * tread + flat_piece, foot = pen.range(2.2, 3.2), d = wide + pen.range(1.6, 3.0);
  const double top = steps * rise, h = top + pen.range(2.5, 2.9), w = foot + run + 2.4;
  slab(pen, -0.2, -0.2, w + 0.2, d + 0.2, pen.chance(0.8) ? h : 0);
  pen.wall_with_door({-0.06, 0}, {-0.06, d}, 0, h, pen.range(0.3, d - 1.3), 0.9);
  pen.wall({w + 0.06, 0}, {w + 0.06, d}, 0, h);
  pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, 0, h);
  pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, 0, h);
  const int first = landing ? steps / 2 : steps;
  const bool open = pen.chance(0.4);
  double z = pen.flight({foot, wide / 2, 0}, 0, first, rise, tread, wide, open);
  double x = foot + first * tread;
  if (landing) {
    pen.box(L::floor, {x, 0, open ? z - 0.15 : 0}, {x + flat_piece, wide, z});
    const double from = z;
    x += flat_piece;
    TrueFlight second;
    for (int i = first; i < steps; ++i) {
      second.rises.push_back(rise);
      z += rise;
      const std::size_t box =
          pen.box(L::stairs, {x, 0, open ? std::max(from, z - rise) - 0.15 : 0}, {x + tread, wide, z});
      const ModelEntity& e = pen.site().model.entities[box];
      second.treads.emplace_back(e.T_map_body.translation() - 0.5 * e.size,
                                 e.T_map_body.translation() + 0.5 * e.size);
      x += tread;
    }
    pen.site().flights.push_back(second);
  }
  pen.box(L::floor, {x, 0, z - 0.2}, {w, d, z});
  if (pen.chance(0.5))
    pen.wall({foot + 1, wide + 0.06}, {x, wide + 0.06}, 0, top + 0.9);  // beside the flight
  pen.solid("box", {1.0, d - 0.5, 0}, 0, {0.5, 0.5, pen.range(0.3, 0.8)});
  if (pen.chance(0.5)) pen.plant({0.6, 0.6, 0});
  pen.stand({1.3, d / 2, pen.range(1.2, 1.6)});                                    // from below
  if (pen.chance(0.6)) pen.stand({foot + run / 2, d - 0.5, pen.range(1.2, 1.7)});  // from the side
  if (pen.chance(0.6)) pen.stand({w - 1.0, d / 2, top + pen.range(1.2, 1.6)});     // from above
  walk(pen, 0.3, 0.3, foot, d - 0.3);
  return std::move(pen.site());
}

/// Two or three storeys of rooms one over the other.
MeanSite storeys(SitePen& pen) {
  const int floors = pen.whole(2, 3);
  const double w = pen.range(6, 8), d = pen.range(4, 5), each = pen.range(2.7, 3.1), clear = each - 0.25;
  for (int f = 0; f < floors; ++f) {
    const double z = f * each, h = z + clear;
    pen.box(L::floor, {-0.2, -0.2, z - (f > 0 ? 0.12 : 0.2)}, {w + 0.2, d + 0.2, z});
    pen.box(L::ceiling, {-0.2, -0.2, h}, {w + 0.2, d + 0.2, h + 0.12});
    pen.wall({-0.06, 0}, {-0.06, d}, z, h);
    pen.wall({w + 0.06, 0}, {w + 0.06, d}, z, h);
    pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, z, h);
    pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, z, h);
    const double middle = pen.range(2.4, w - 2.6);
    pen.wall_with_door({middle, 0}, {middle, d}, z, h, pen.range(0.5, d - 1.5), 0.9);
    dining(pen, {middle / 2 + 0.2, d * 0.62, z});
    pen.solid("cupboard", {w - 0.3, d / 2, z}, 0, {0.6, 1.2, pen.range(1.0, 2.0)});
    pen.sofa({0.5 * (middle + w), d - 0.5, z}, 0, 1.6);
    if (pen.chance(0.5)) pen.shelf({middle + 0.9, 0.16, z}, 2, 1.0, pen.range(1.0, 2.0));
    pen.stand({middle - 0.8, 0.9, z + pen.range(1.1, 1.6)});
    pen.stand({0.5 * (middle + w), 1.2, z + pen.range(1.1, 1.6)});
  }
  walk(pen, 0.5, 0.5, w - 0.5, d - 0.5);
  return std::move(pen.site());
}

/// Bushes, a hedge, a piece of fence, bollards.
void plant_yard(SitePen& pen, double w, double d) {
  for (int k = 0; k < 2; ++k)
    pen.bush({pen.shape(1, w - 1, 0), pen.shape(1.5, d - 0.5, 0), 0}, pen.shape(0.5, 1.8, 0),
             pen.shape(0.5, 2, 0));
  pen.bush({pen.shape(1, w - 1, 0), 0.4, 0}, pen.shape(1, 2.5, 0), pen.shape(0.8, 1.6, 0));
  const double x = pen.shape(1, w - 4, 0), along = pen.shape(1, 2.5, 0), high = pen.shape(0.8, 1.8, 0);
  std::vector<SitePen::Part> bars = {{{0, 0, high - 0.06}, {along, 0.04, high}}};
  for (double s = 0; s < along; s += 0.15) bars.push_back({{s, 0, 0}, {s + 0.04, 0.04, high}});
  pen.thing("thing", {x, 0.1, 0}, 0, bars);
  for (int k = 0; k < 3; ++k)
    pen.solid("thing", {pen.shape(1, w - 1, 0), d - 0.3, 0}, 0, {0.15, 0.15, pen.shape(0.5, 2.8, 0)});
}

/// Outdoors: a facade, a kerb, a ramp to a door, steps, cars, boxes; no ceiling.
MeanSite yard(SitePen& pen) {
  const double w = pen.range(12, 18), d = pen.range(8, 12), h = pen.range(3.5, 5),
               kerb = pen.range(0.10, 0.16);
  slab(pen, -1, -1, w + 1, d, 0);
  pen.box(L::floor, {-1, d, -0.2}, {w + 1, d + 3.5, kerb});  // the pavement
  pen.site().kerbs.push_back({{-0.8, d}, {w + 1, d}, 0, kerb});
  const double front = d + 3.5;
  pen.wall({-1, front + 0.1}, {w * 0.4, front + 0.1}, 0, h, 0.2);
  pen.wall({w * 0.4 + 1.1, front + 0.1}, {w + 1, front + 0.1}, 0, h, 0.2);
  pen.wall({w * 0.4, front + 0.1}, {w * 0.4 + 1.1, front + 0.1}, 2.2, h, 0.2);
  pen.site().doors.push_back({{w * 0.4 + 0.55, front + 0.1}, 1.1, 0, Eigen::Vector2d::UnitX()});
  pen.wall({-0.9, d * 0.3}, {-0.9, front}, 0, h, 0.2);
  pen.flight({w * 0.75, front - 1.2, kerb}, 1, 4, pen.range(0.14, 0.17), 0.3, 1.6, false);
  const double slope = pen.range(0.05, 0.11);
  pen.ramp({w * 0.15, front - 0.9, kerb}, 0, slope, 3 * std::sin(slope), 1.4, 0.2);
  for (int k = 0; k < 2; ++k) {
    const double x = pen.range(2, w - 5), y = k == 0 ? d - 1.2 : 1.2;
    pen.thing("car", {x, y, 0}, 0,
              {{{0, -0.85, 0.25}, {4.2, 0.85, 0.85}},
               {{0.9, -0.8, 0.85}, {3.4, 0.8, 1.45}},
               {{0.5, -0.85, 0}, {1.1, 0.85, 0.3}},
               {{3.1, -0.85, 0}, {3.7, 0.85, 0.3}}});
  }
  pen.solid("box", {w * 0.55, d * 0.5, 0}, 0,
            {pen.range(0.5, 1.2), pen.range(0.5, 1.2), pen.range(0.4, 1.2)});
  pen.person({w * 0.35, d * 0.45, 0}, 0);
  if (pen.varied()) plant_yard(pen, w, d);
  scatter(pen, 1, 1, w - 1, d - 1);
  pen.box(L::pillar, {w * 0.6, d + 2.0, kerb}, {w * 0.6 + 0.3, d + 2.3, 3.0});
  pen.stand({w * 0.3, d * 0.6, pen.range(1.2, 1.7)});
  pen.stand({w * 0.7, d * 0.55, pen.range(1.2, 1.7)});
  if (pen.chance(0.5)) pen.stand({w * 0.5, front - 1.5, kerb + 1.4});
  walk(pen, 1, 3, w - 1, d - 2);
  return std::move(pen.site());
}

/// A hall with a raised part: a ramp and steps up to it, a wedge before the sill of a door.
MeanSite ramps(SitePen& pen) {
  const double w = pen.range(13, 17), d = pen.range(6, 8), up = pen.range(0.35, 0.9),
               h = up + pen.range(2.5, 3.2);
  const double edge = w - pen.range(3.0, 4.5), wide = pen.range(1.0, 1.8);
  slab(pen, -0.2, -0.2, w + 0.2, d + 0.2, pen.chance(0.7) ? h : 0);
  pen.wall_with_door({-0.06, 0}, {-0.06, d}, 0, h, d / 2 - 0.45, 0.9);
  pen.wall({w + 0.06, 0}, {w + 0.06, d}, 0, h);
  pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, 0, h);
  pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, 0, h);
  pen.box(L::floor, {edge, 0, 0}, {w, d, up});
  const double slope = std::max(pen.range(0.08, 0.22), std::atan(up / 7)), from = pen.chance(0.5) ? 0 : 0.8;
  pen.ramp({edge - up / std::tan(slope), from + wide / 2, 0}, 0, slope, up, wide, up + 0.2);
  const int steps = std::max(2, static_cast<int>(std::lround(up / 0.17)));
  pen.flight({edge - 0.3 * steps, d - 1.2, 0}, 0, steps, up / steps, 0.3, 1.6, false);
  const double sill = pen.range(0.10, 0.18), gentle = pen.range(0.09, 0.15);
  pen.ramp({sill / std::tan(gentle), d / 2, 0}, EIGEN_PI, gentle, sill, 1.2, sill + 0.1);
  if (pen.chance(0.5)) {  // a railing beside the ramp
    std::vector<SitePen::Part> bars = {{{0, 0, up + 0.9}, {edge - 4, 0.04, up + 0.95}}};
    for (double s = 0; s < edge - 4; s += 1.2) bars.push_back({{s, 0, 0}, {s + 0.04, 0.04, up + 0.9}});
    pen.thing("thing", {4, from + wide + 0.05, 0}, 0, bars);
  }
  dining(pen, {pen.range(3.5, 4.5), d * 0.62, 0});
  pen.solid("box", {edge + 1.5, d * 0.6, up}, 0, {pen.range(0.4, 1.0), 0.6, pen.range(0.3, 1.1)});
  pen.solid("box", {edge - 1.2, d * 0.45, 0}, 0, {0.5, pen.range(0.4, 0.9), pen.range(0.3, 0.9)});
  pen.person({edge * 0.55, d * 0.5, 0}, 0);
  scatter(pen, 1, wide + 1, edge - 2, d - 1);
  pen.stand({pen.range(2.2, 3.2), d * 0.35, pen.range(1.1, 1.6)});
  pen.stand({edge - 2.5, d * 0.6, pen.range(1.1, 1.6)});
  if (pen.chance(0.6)) pen.stand({edge + 1.0, d * 0.35, up + pen.range(1.1, 1.6)});
  walk(pen, 1, 0.5, edge, d - 0.5);
  return std::move(pen.site());
}

/// Rows of desks, shelves up to the ceiling, partitions of half height, glass.
MeanSite office(SitePen& pen) {
  const double w = pen.range(9, 13), d = pen.range(7, 9), h = pen.range(2.6, 3.2);
  slab(pen, -0.2, -0.2, w + 0.2, d + 0.2, pen.chance(0.75) ? h : 0);
  pen.wall({-0.06, 0}, {-0.06, d}, 0, h);
  pen.wall_with_door({w + 0.06, 0}, {w + 0.06, d}, 0, h, pen.range(0.5, 2.0), 0.9);
  pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, 0, h);
  pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, 0, h);
  // A meeting room behind glass: no wall is measured where the glass is.
  const double mx = pen.range(3.0, 3.8), my = pen.range(2.6, 3.2);
  pen.wall({mx, d}, {mx, d - 1.0}, 0, h);
  pen.wall({0, d - my}, {mx - 1.2, d - my}, 0, h);
  dining(pen, {mx * 0.45, d - my * 0.5, 0});
  for (double x = mx + 1.6; x + 0.9 < w; x += pen.range(2.3, 2.9)) {
    for (const double y : {d * 0.3, d * 0.68}) {
      pen.table({x, y, 0}, 1, 1.5, 0.75, pen.range(0.70, 0.76));
      if (pen.chance(0.8)) pen.chair({x + 0.75, y + pen.range(-0.2, 0.2), 0}, 3);
      if (pen.chance(0.6)) pen.solid("thing", {x - 0.2, y, 0.76}, 0, {0.06, 0.5, 0.35});  // a screen
    }
  }
  const double p = pen.range(1.25, 1.6);
  pen.solid("thing", {mx + 0.9, d * 0.3, 0}, 0, {0.05, 1.8, p});  // a partition
  pen.solid("cupboard", {1.6, 0.22, 0}, 0, {pen.range(1.6, 2.4), 0.42, pen.chance(0.5) ? h - 0.02 : 1.95});
  pen.shelf({mx + 2.0, 0.16, 0}, 2, 1.8, pen.range(1.6, h - 0.1));
  pen.box(L::pillar, {w * 0.5, d * 0.48, 0}, {w * 0.5 + 0.35, d * 0.48 + 0.35, h});
  if (pen.chance(0.6)) pen.plant({w - 0.5, d - 0.5, 0});
  if (pen.chance(0.6)) pen.person({w - 1.2, d * 0.5, 0}, 1);
  pen.solid("bin", {w - 0.35, 0.35, 0}, 0, {0.3, 0.3, 0.6});
  scatter(pen, 0.8, 0.8, w - 0.8, d - 0.8);
  pen.stand({mx + 0.7, d * 0.5, pen.range(1.2, 1.6)});
  pen.stand({w - 0.9, d * 0.5 + 0.9, pen.range(1.2, 1.6)});
  if (pen.chance(0.7)) pen.stand({mx * 0.5, d - my + 0.6, pen.range(1.2, 1.6)});
  walk(pen, mx, 0.5, w - 0.5, d - 0.5);
  return std::move(pen.site());
}

/// Oddments in the corners and along the walls of a room.
void litter(SitePen& pen, double x0, double y0, double x1, double y1, int max_count) {
  for (int k = pen.whole(max_count / 2, max_count); k > 0; --k) {
    const bool along_x = pen.chance(0.5);
    const double off = pen.range(0.2, 0.45);
    const double x = along_x ? pen.range(x0 + 0.5, x1 - 0.5) : pen.chance(0.5) ? x0 + off : x1 - off;
    const double y = !along_x ? pen.range(y0 + 0.5, y1 - 0.5) : pen.chance(0.5) ? y0 + off : y1 - off;
    pen.oddment({x, y, 0}, pen.range(0.15, 0.5));
  }
}

/// Oddments on a table.
void on_table(SitePen& pen, const Eigen::Vector3d& at, double along, double deep) {
  for (int k = pen.whole(1, 4); k > 0; --k)
    pen.oddment(at + Eigen::Vector3d(pen.range(-0.4, 0.4) * along, pen.range(-0.4, 0.4) * deep, 0),
                pen.range(0.08, 0.3));
}

/// Four rooms and a corridor, full.
MeanSite apartment(SitePen& pen) {
  const double w = pen.range(8.5, 11), d = pen.range(7.5, 9.5), h = pen.range(2.4, 2.8);
  const double x1 = w * pen.range(0.42, 0.55), y1 = d * pen.range(0.38, 0.46), y2 = y1 + pen.range(1.1, 1.4);
  slab(pen, -0.2, -0.2, w + 0.2, d + 0.2, pen.chance(0.7) ? h : 0);
  pen.wall({-0.06, 0}, {-0.06, d}, 0, h);
  pen.wall_with_door({w + 0.06, 0}, {w + 0.06, d}, 0, h, y1 + 0.15, 0.9);
  pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, 0, h);
  const double from = pen.range(0.8, 1.4), to = from + pen.range(1.2, 1.8);
  pen.wall({-0.12, d + 0.06}, {from, d + 0.06}, 0, h);
  pen.wall({to, d + 0.06}, {w + 0.12, d + 0.06}, 0, h);
  pen.wall({from, d + 0.06}, {to, d + 0.06}, 0, 0.9);
  pen.wall({from, d + 0.06}, {to, d + 0.06}, 2.15, h);
  pen.site().glass.push_back(pen.box(kNotJudged, {from, d + 0.05, 0.9}, {to, d + 0.07, 2.15}));
  pen.curtain({from - 0.4, d - 0.12}, 0.5, 0.05, h - 0.1);
  pen.curtain({to - 0.1, d - 0.12}, 0.5, 0.05, h - 0.1);
  // A corridor between y1 and y2; beyond it a bedroom and a bath, before it a living room and a kitchen.
  pen.wall_with_door({0, y2}, {x1, y2}, 0, h, pen.range(0.6, 1.2), 0.85);
  pen.wall_with_door({x1, y2}, {w, y2}, 0, h, pen.range(0.5, 1.0), 0.8);
  pen.wall({x1, y2}, {x1, d}, 0, h);
  pen.wall_with_door({0, y1}, {x1, y1}, 0, h, x1 - pen.range(1.6, 2.2), 0.9);
  // The kitchen is open to the corridor but for a stub, and a bar in its line.
  pen.wall({x1, 0}, {x1, y1 + 0.06}, 0, h);
  const double stub = pen.range(0.6, 1.2);
  pen.wall({x1, y1}, {x1 + stub, y1}, 0, h);
  pen.solid("counter", {w - 1.1, y1 + pen.range(-0.03, 0.03), 0}, 0, {1.8, 0.4, pen.range(1.0, 1.15)});
  // Bedroom.
  pen.bed({pen.range(1.6, x1 - 1.6), d - 1.6, 0}, 0);
  const double high = pen.chance(0.5) ? h - 0.02 : 2.0;
  pen.solid("cupboard", {x1 - 0.36, d - 0.9, 0}, 0, {0.6, pen.range(1.0, 1.6), high});
  pen.table({0.45, y2 + 0.9, 0}, 1, 0.9, 0.5, 0.72);
  on_table(pen, {0.45, y2 + 0.9, 0.72}, 0.5, 0.9);
  litter(pen, 0, y2, x1, d, 4);
  // Bath: a basin under a mirror, a tub, a curtain before it.
  pen.solid("cupboard", {x1 + 0.06 + 0.25, y2 + 0.9 + 0.3, 0}, 0, {0.45, 0.6, 0.85});
  pen.site().mirrors.push_back(pen.box(kNotJudged, {x1 + 0.06, y2 + 0.9, 1.1}, {x1 + 0.075, y2 + 1.6, 1.9}));
  pen.solid("thing", {w - 0.4, d - 0.9, 0}, 0, {0.75, 1.7, 0.58});
  if (pen.chance(0.5)) pen.curtain({w - 1.3, d - 1.8}, 0.5, 0.2, 2.0);
  // Living room.
  pen.sofa({1.6, 0.46, 0}, 2, pen.range(1.6, 2.2));
  pen.table({1.7, 1.6, 0}, 0, 1.0, 0.6, pen.range(0.36, 0.46));
  on_table(pen, {1.7, 1.6, 0.42}, 1.0, 0.6);
  pen.shelf({0.17, y1 - 0.8, 0}, 1, 1.0, pen.range(1.3, 2.2));
  pen.solid("cupboard", {x1 - 0.28, 1.2, 0}, 0, {0.42, 1.4, pen.range(0.5, 1.3)});
  if (pen.chance(0.6)) pen.plant({x1 - 0.5, y1 - 0.5, 0});
  litter(pen, 0, 0, x1, y1, 5);
  // Kitchen: counters and what hangs over them along the far wall; a table.
  const double k = w - x1 - 0.9;
  pen.solid("counter", {w - k / 2, 0.32, 0}, 0, {k, 0.6, 0.9});
  pen.solid("cupboard", {w - k / 2, 0.2, 1.45}, 0, {k, 0.36, pen.range(0.6, 0.8)});
  on_table(pen, {w - k / 2, 0.32, 0.9}, k, 0.5);
  pen.solid("cupboard", {x1 + 0.46, 0.35, 0}, 0, {0.62, 0.62, pen.chance(0.5) ? h - 0.02 : 1.8});
  dining(pen, {0.5 * (x1 + w) + 0.2, y1 - 1.3, 0});
  litter(pen, x1, 0, w, y1, 3);
  scatter(pen, 0.8, 0.8, w - 0.8, d - 0.8);
  if (pen.chance(0.6)) pen.site().walkers.push_back({{x1 - 1.2, 1.2, 0}, {x1 - 1.0, y1 - 0.4, 0}});
  const double eye = pen.range(0.9, 1.5);
  for (const auto& [x, y] : {std::pair{x1 * 0.62, y1 * 0.6},
                             {x1 * 0.7, 0.5 * (y1 + y2)},
                             {x1 * 0.5, y2 + 1.1},
                             {0.5 * (x1 + w), 0.5 * (y1 + y2)},
                             {0.5 * (x1 + w) - 0.3, y2 + 1.2},
                             {x1 + 0.9, y1 - 0.8},
                             {w - 0.7, y1 + 0.7}})
    pen.stand({x, y, eye});
  walk(pen, 0.6, 0.6, x1 - 0.4, y1 - 0.4);
  return std::move(pen.site());
}

/// A flight as before a public building: wide, long, between cheeks or open at the sides.
MeanSite big_steps(SitePen& pen) {
  const int first = pen.whole(5, 12), second = pen.chance(0.6) ? pen.whole(4, 9) : 0;
  const double rise = pen.range(0.14, 0.18), tread = pen.range(0.29, 0.36), wide = pen.range(2.5, 6);
  const double foot = pen.range(4, 6), landing = second > 0 ? pen.range(1.2, 2.0) : 0;
  const double top = (first + second) * rise, end = foot + (first + second) * tread + landing;
  slab(pen, -2, -4, end + 4, wide + 4, 0);
  double z = pen.flight({foot, wide / 2, 0}, 0, first, rise, tread, wide, false);
  double x = foot + first * tread;
  if (second > 0) {
    pen.box(L::floor, {x, 0, 0}, {x + landing, wide, z});
    pen.flight({x + landing, wide / 2, z}, 0, second, rise, tread, wide, false);
    // Boxes of an upper flight stand on its landing's level: fill what is under them.
    pen.box(kNotJudged, {x + landing, 0, 0}, {end, wide, z});
  }
  pen.box(L::floor, {end, -3, 0}, {end + 3, wide + 3, top});
  pen.wall({end + 3.1, -3}, {end + 3.1, wide + 3}, 0, top + pen.range(3, 4), 0.2);
  if (pen.chance(0.5)) {
    pen.wall({foot - 0.3, -0.15}, {end, -0.15}, 0, top + pen.range(0.2, 1.0), 0.3);
  }
  if (pen.chance(0.5)) pen.wall({foot, wide + 0.1}, {end, wide + 0.1}, 0, top + 2.5, 0.2);
  if (pen.chance(0.6)) {  // a rail in the middle
    std::vector<SitePen::Part> posts;
    for (int i = 0; i < first; i += 3)
      posts.push_back({{i * tread, 0, i * rise}, {i * tread + 0.05, 0.05, i * rise + 1.05}});
    pen.thing("thing", {foot, wide * 0.5, 0}, 0, posts);
  }
  pen.wall({-2, wide + 3.9}, {foot + 2, wide + 3.9}, 0, pen.range(3, 5), 0.2);
  pen.solid("box", {1.5, -1.5, 0}, 0, {0.6, 0.5, pen.range(0.4, 0.9)});
  pen.plant({2.5, wide + 1.5, 0});
  pen.person({foot - 1.2, wide * 0.3, 0}, 0);
  pen.stand({foot - pen.range(2.0, 3.5), wide * pen.range(0.3, 0.7), pen.range(1.0, 1.6)});
  pen.stand({foot + pen.range(0.5, 2.5), pen.chance(0.5) ? -1.8 : wide * 0.5, pen.range(1.4, 2.4)});
  if (pen.chance(0.5)) pen.stand({foot + first * tread * 0.6, wide * 0.5, first * rise * 0.6 + 1.4});
  walk(pen, foot - 3, wide * 0.2, foot - 0.5, wide * 0.8);
  return std::move(pen.site());
}

/// Two storeys, each with a partition of its own place, joined by an open flight along a wall.
MeanSite two_plans(SitePen& pen) {
  const double w = pen.range(8, 10), d = pen.range(5, 6.5), each = pen.range(2.8, 3.1), clear = each - 0.25;
  const int steps = 16;
  const double rise = each / steps, run = steps * 0.27, x0 = 1.0, wide = 1.0;
  for (int f = 0; f < 2; ++f) {
    const double z = f * each, h = z + clear;
    for (const L label : {L::floor, L::ceiling}) {
      const double low = label == L::floor ? z - (f > 0 ? 0.12 : 0.2) : h,
                   high = label == L::floor ? z : h + 0.12;
      const bool hole = (label == L::floor) == (f == 1);  // over the flight
      pen.box(label, {-0.2, hole ? wide + 0.1 : -0.2, low}, {w + 0.2, d + 0.2, high});
      if (hole) pen.box(label, {x0 + run, -0.2, low}, {w + 0.2, wide + 0.1, high});
    }
    pen.wall({-0.06, 0}, {-0.06, d}, z, h);
    pen.wall({w + 0.06, 0}, {w + 0.06, d}, z, h);
    pen.wall({-0.12, -0.06}, {w + 0.12, -0.06}, z, h);
    pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, z, h);
    const double at = f == 0 ? pen.range(x0 + run + 0.3, w - 1.4) : pen.range(x0 + 1.5, x0 + run - 1);
    pen.wall_with_door({at, wide + 0.2}, {at, d}, z, h, pen.range(0.4, d - wide - 1.6), 0.9);
    pen.solid("cupboard", {w - 0.3, d / 2, z}, 0, {0.55, pen.range(0.8, 1.6), pen.chance(0.4) ? clear : 1.9});
    dining(pen, {f == 0 ? 2.4 : w - 2.0, d - 1.4, z});
    pen.shelf({0.17, d - 1.0, z}, 1, 1.0, pen.range(1.0, 2.1));
    pen.oddment({w - 0.6, d - 0.6, z}, 0.4);
    scatter(pen, 0.8, wide + 0.6, w - 0.8, d - 0.8, z);
    pen.stand({at - 1.0, d * 0.55, z + pen.range(1.1, 1.6)});
    pen.stand({std::min(at + 0.9, w - 0.5), d * 0.5, z + pen.range(1.1, 1.6)});
  }
  pen.flight({x0, wide / 2, 0}, 0, steps, rise, 0.27, wide - 0.05, true);
  pen.stand({x0 + 0.3, d * 0.45, 1.4});
  walk(pen, 0.5, wide + 0.4, w - 0.5, d - 0.5);
  return std::move(pen.site());
}

/// A flight up to a gallery; beside it a wall that leaves it, or comes nearer, by up to 28 degrees.
MeanSite askew(SitePen& pen) {
  const int steps = pen.whole(7, 12);
  const double rise = pen.range(0.15, 0.19), tread = pen.range(0.25, 0.31), wide = pen.range(0.9, 1.6);
  const double foot = pen.range(2.2, 3.0), run = steps * tread, end = foot + run, w = end + 2.2, side = -2.8;
  const double top = steps * rise, h = top + pen.range(2.3, 2.8);
  const double slant = std::tan(pen.range(8, 28) * EIGEN_PI / 180), gap = pen.range(0.1, 0.5);
  const double length = run + 0.8, far = wide + gap + slant * length, d = far + 0.4;
  slab(pen, -0.2, side - 0.2, w + 0.2, d + 0.2, pen.chance(0.8) ? h : 0);
  pen.wall({-0.06, side}, {-0.06, d}, 0, h);
  pen.wall({w + 0.06, side}, {w + 0.06, d}, 0, h);
  pen.wall({-0.12, side - 0.06}, {w + 0.12, side - 0.06}, 0, h);
  pen.wall({-0.12, d + 0.06}, {w + 0.12, d + 0.06}, 0, h);
  const bool leaves = pen.chance(0.5);
  pen.wall({foot - 0.4, leaves ? wide + gap : far}, {end + 0.4, leaves ? far : wide + gap}, 0, h);
  pen.flight({foot, wide / 2, 0}, 0, steps, rise, tread, wide, pen.chance(0.6));
  pen.box(L::floor, {end, side, top - 0.2}, {w, d, top});
  pen.solid("box", {0.8, side + 0.6, 0}, 0, {0.5, 0.5, pen.range(0.3, 0.8)});
  pen.stand({foot - pen.range(1.0, 1.6), pen.range(-0.5, wide), pen.range(1.2, 1.6)});
  pen.stand({foot + run * pen.range(0.3, 0.8), pen.range(-1.8, -1.0), pen.range(1.2, 1.7)});
  if (pen.chance(0.5)) pen.stand({w - 0.9, pen.range(-1.5, 1.0), top + pen.range(1.2, 1.6)});
  walk(pen, 0.4, side + 0.5, end - 0.3, -0.4);
  return std::move(pen.site());
}

}  // namespace

namespace {

std::uint64_t seed_of_pen(SiteKind kind, std::uint64_t seed) {
  const auto k = static_cast<std::uint64_t>(kind);
  return k < 5 ? seed * 5 + k : k < kSiteKinds ? seed * 8 + 1'000'000 + k : seed * 32 + 2'000'000 + k;
}

}  // namespace

MeanSite mean_site(SiteKind kind, std::uint64_t seed, bool varied) {
  SitePen pen(seed_of_pen(kind, seed), varied);
  pen.site().kind = kind;
  switch (kind) {
    case SiteKind::flat:
      return flat(pen);
    case SiteKind::stair_hall:
      return stair_hall(pen);
    case SiteKind::storeys:
      return storeys(pen);
    case SiteKind::yard:
      return yard(pen);
    case SiteKind::office:
      return office(pen);
    case SiteKind::apartment:
      return apartment(pen);
    case SiteKind::big_steps:
      return big_steps(pen);
    case SiteKind::two_plans:
      return two_plans(pen);
    case SiteKind::ramps:
      return ramps(pen);
    case SiteKind::askew:
      return askew(pen);
    case SiteKind::attic:
      return test::attic(pen);
    case SiteKind::bulkheads:
      return test::bulkheads(pen);
    case SiteKind::car_park:
      return test::car_park(pen);
    case SiteKind::carriage:
      return test::carriage(pen);
    case SiteKind::container_yard:
      return test::container_yard(pen);
    case SiteKind::cubicles:
      return test::cubicles(pen);
    case SiteKind::mirror_hall:
      return test::mirror_hall(pen);
    case SiteKind::rubble:
      return test::rubble(pen);
    case SiteKind::split_level:
      return test::split_level(pen);
    case SiteKind::stage:
      return test::stage(pen);
    case SiteKind::tunnel:
      return test::tunnel(pen);
    case SiteKind::walkers:
      return test::walkers(pen);
  }
  return {};
}

}  // namespace parhelion::test

#include "fusion/semantic/objects/classify_object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

/// A range that a kind's measure lies in, with the softness of its ends.
struct Range {
  double low, high, soft;
  double penalty(double v) const { return std::max({0.0, low - v, v - high}) / soft; }
};

/// What is usual for a kind: full lengths and heights over the floor, m. A part that is not seen makes
/// lengths shorter, so that their lower ends are soft.
struct Usual {
  ObjectKind kind;
  Range length, width, bottom, top;
  Range plate;       ///< height of its widest level top
  Range plate_area;  ///< m^2
  Range filled;      ///< of its upright faces
  double bias;
  Posture posture = Posture::unknown;
};

constexpr double kAny = 1e3;
constexpr Range kNothing{-kAny, kAny, 1};

constexpr Usual kUsual[] = {
    {ObjectKind::chair,
     {0.3, 0.72, 0.08},
     {0.25, 0.62, 0.08},
     {0, 0.35, 0.1},
     {0.42, 1.15, 0.08},
     {0.36, 0.75, 0.05},
     {0.04, 0.36, 0.06},
     kNothing,
     0},
    // A chair whose seat is hidden, under a table mostly: its back or what is left of it.
    {ObjectKind::chair,
     {0.3, 0.65, 0.08},
     {0.08, 0.6, 0.08},
     {0, 0.5, 0.1},
     {0.72, 1.08, 0.08},
     kNothing,
     {-1, 0.3, 0.06},
     kNothing,
     -0.25},
    {ObjectKind::sofa,
     {1.1, 2.8, 0.15},
     {0.6, 1.2, 0.12},
     {0, 0.2, 0.1},
     {0.6, 1.1, 0.08},
     {0.33, 0.55, 0.05},
     {0.35, 2.2, 0.15},
     kNothing,
     0},
    {ObjectKind::bed,
     {1.6, 2.4, 0.15},
     {0.8, 2.1, 0.12},
     {0, 0.25, 0.1},
     {0.35, 1.2, 0.1},
     {0.28, 0.75, 0.06},
     {1.1, 4.5, 0.25},
     kNothing,
     0},
    {ObjectKind::counter,
     {1.2, 6, 0.2},
     {0.15, 0.9, 0.1},
     {0, 0.2, 0.1},
     {0.8, 1.5, 0.08},
     {0.82, 1.18, 0.05},
     {0.2, 5, 0.2},
     {0.3, 1, 0.15},
     0},
    {ObjectKind::cupboard,
     {0.5, 3.5, 0.12},
     {0.05, 0.85, 0.1},
     {0, 0.25, 0.1},
     {1.15, 3, 0.1},
     kNothing,
     kNothing,
     {0.35, 1, 0.1},
     -0.2},
    {ObjectKind::cupboard,
     {0.5, 2.0, 0.12},
     {0.2, 0.8, 0.1},
     {0, 0.2, 0.1},
     {0.45, 1.2, 0.1},
     {0.4, 1.2, 0.1},
     {0.08, 1.2, 0.15},
     {0.3, 1, 0.1},
     -0.4},
    {ObjectKind::cupboard,
     {0.5, 4, 0.12},
     {0.03, 0.5, 0.08},
     {1.15, 1.8, 0.1},
     {1.8, 2.9, 0.1},
     kNothing,
     kNothing,
     kNothing,
     0},
    {ObjectKind::shelf,
     {0.6, 3, 0.12},
     {0.05, 0.5, 0.06},
     {0, 0.25, 0.1},
     {0.9, 3, 0.1},
     kNothing,
     {-1, 0.6, 0.2},
     {0.2, 0.62, 0.08},
     -0.1},
    {ObjectKind::plant,
     {0.25, 1.1, 0.1},
     {0.2, 0.9, 0.1},
     {0, 0.3, 0.1},
     {1.0, 2.2, 0.1},
     kNothing,
     {-1, 0.12, 0.05},
     {0.05, 0.6, 0.1},
     -0.1},
    {ObjectKind::bin,
     {0.18, 0.5, 0.05},
     {0.12, 0.45, 0.05},
     {0, 0.1, 0.06},
     {0.25, 0.85, 0.06},
     kNothing,
     {-1, 0.2, 0.05},
     {0.4, 1, 0.1},
     -0.2},
    {ObjectKind::box,
     {0.3, 1.4, 0.1},
     {0.25, 1.2, 0.08},
     {0, 0.1, 0.06},
     {0.15, 1.25, 0.08},
     {0.15, 1.25, 0.06},
     {0.1, 1.6, 0.08},
     {0.4, 1, 0.1},
     -0.6},
    {ObjectKind::person,
     {0.3, 0.75, 0.08},
     {0.12, 0.55, 0.06},
     {0, 0.3, 0.1},
     {1.45, 2.0, 0.05},
     kNothing,
     {-1, 0.12, 0.05},
     {0.2, 1, 0.1},
     0,
     Posture::standing},
    // With the chair or stool under it, which it hides.
    {ObjectKind::person,
     {0.55, 1.0, 0.08},
     {0.35, 0.7, 0.08},
     {0, 0.15, 0.08},
     {1.18, 1.45, 0.05},
     kNothing,
     {-1, 0.3, 0.05},
     {0.55, 0.9, 0.1},
     0,
     Posture::sitting},
    // On the floor, legs drawn up or stretched out.
    {ObjectKind::person,
     {0.75, 1.2, 0.08},
     {0.35, 0.65, 0.08},
     {0, 0.1, 0.06},
     {0.78, 1.02, 0.05},
     kNothing,
     {-1, 0.35, 0.05},
     {0.25, 0.7, 0.08},
     0,
     Posture::sitting},
    {ObjectKind::person,
     {1.5, 1.95, 0.08},
     {0.35, 0.8, 0.08},
     {0, 0.1, 0.06},
     {0.17, 0.4, 0.04},
     kNothing,
     {-1, 0.6, 0.1},
     {0.3, 1, 0.15},
     -0.2,
     Posture::lying},
    {ObjectKind::car,
     {3.0, 5.2, 0.3},
     {1.0, 2.1, 0.2},
     {0, 0.45, 0.1},
     {1.2, 2.1, 0.1},
     kNothing,
     kNothing,
     kNothing,
     0.3},
};

double score_of(const ObjectShape& s, const Usual& u) {
  return u.bias - u.length.penalty(s.length) - u.width.penalty(s.width) - u.bottom.penalty(s.bottom) -
         u.top.penalty(s.top) - u.plate.penalty(s.plate) - u.plate_area.penalty(s.plate_area) -
         u.filled.penalty(s.filled);
}

/// The rectangle of least area around most of the plan.
void fit_rectangle(const std::vector<Eigen::Vector2d>& plan, double cell, ObjectShape& shape) {
  constexpr int kTurns = 30;
  double best = std::numeric_limits<double>::max();
  std::vector<double> s(plan.size()), t(plan.size());
  for (int k = 0; k < kTurns; ++k) {
    const double yaw = 0.5 * EIGEN_PI * k / kTurns;
    const Eigen::Vector2d along(std::cos(yaw), std::sin(yaw)), across(-along.y(), along.x());
    for (std::size_t i = 0; i < plan.size(); ++i) s[i] = along.dot(plan[i]), t[i] = across.dot(plan[i]);
    const double s0 = quantile(s, 0.01), s1 = quantile(s, 0.99), t0 = quantile(t, 0.01),
                 t1 = quantile(t, 0.99);
    const double area = (s1 - s0 + cell) * (t1 - t0 + cell);
    if (area > 0.995 * best) continue;
    best = area;
    shape.middle = 0.5 * (s0 + s1) * along + 0.5 * (t0 + t1) * across;
    shape.length = s1 - s0 + cell, shape.width = t1 - t0 + cell, shape.yaw = yaw;
  }
  if (shape.width <= shape.length) return;
  std::swap(shape.width, shape.length);
  shape.yaw -= 0.5 * EIGEN_PI;
}

/// Fraction of the upright faces, looked at along the box's longer and its shorter side, that cubes fill.
double filled_fraction(const ObjectGrid& grid, const ObjectGroup& group, const ObjectShape& shape) {
  const Eigen::Vector2d along(std::cos(shape.yaw), std::sin(shape.yaw));
  std::set<std::pair<int, int>> seen;
  for (const std::uint32_t c : group.cubes)
    seen.emplace(static_cast<int>(std::floor(along.dot(grid.plan(c)) / grid.cell())), grid.cubes()[c].at.z());
  const double high = std::max(grid.cell(), shape.top - shape.bottom);
  return std::min(1.0, static_cast<double>(seen.size()) * grid.cell() * grid.cell() / (shape.length * high));
}

}  // namespace

ObjectShape shape_of(const ObjectGrid& grid, const ObjectGroup& group,
                     const std::vector<ObjectPlate>& plates) {
  ObjectShape shape;
  shape.table = group.table;
  shape.cubes = group.cubes.size();
  std::vector<Eigen::Vector2d> plan;
  std::vector<double> heights, floors;
  for (const std::uint32_t c : group.cubes) {
    if (plan.empty() || plan.back() != grid.plan(c)) plan.push_back(grid.plan(c));
    heights.push_back(grid.height(c)), floors.push_back(grid.floor(c));
  }
  fit_rectangle(plan, grid.cell(), shape);
  shape.floor = quantile(floors, 0.5);
  shape.bottom = std::max(0.0, quantile(heights, 0.01) - 0.5 * grid.cell());
  if (shape.bottom < 0.12) shape.bottom = 0;
  shape.top = quantile(heights, 0.99) + 0.25 * grid.cell();
  for (const ObjectPlate& plate : plates) {
    const bool inside =
        std::binary_search(group.cubes.begin(), group.cubes.end(), plate.cubes[plate.cubes.size() / 2]);
    if (!inside) continue;
    shape.plates += plate.area;
    if (plate.area > shape.plate_area)
      shape.plate_area = plate.area, shape.plate = plate.height, shape.sides = plate.sides;
  }
  shape.filled = filled_fraction(grid, group, shape);
  return shape;
}

ObjectClass classify(const ObjectShape& shape) {
  // As large as a mattress and as low; what is under it is not seen.
  constexpr double kMattress = 1.3, kLow = 0.62;  // m^2, m
  if (shape.table && shape.plate_area > kMattress && shape.plate < kLow) return {ObjectKind::bed, 0.6};
  if (shape.table) return {ObjectKind::table, std::clamp(0.6 + shape.plate_area, 0.5, 0.95)};
  constexpr double kPoor = -2.5;  // worse than this it is only an object
  // Bushes and hedges in a street are about as large as somebody who sits: a victim must fit nearly all
  // ranges.
  constexpr double kPoorVictim = 0.4;
  double best = kPoor, second = kPoor;
  ObjectKind kind = ObjectKind::object;
  Posture posture = Posture::unknown;
  for (const Usual& usual : kUsual) {
    const double score = score_of(shape, usual);
    const bool may_be_victim = usual.posture == Posture::sitting || usual.posture == Posture::lying;
    if (may_be_victim && score < usual.bias - kPoorVictim) continue;
    if (score > best) {
      if (usual.kind != kind) second = best;
      best = score, kind = usual.kind, posture = usual.posture;
    } else if (usual.kind != kind) {
      second = std::max(second, score);
    }
  }
  return {kind, kind == ObjectKind::object ? 0.5 : 1 / (1 + std::exp(second - best)), posture};
}

}  // namespace parhelion::semantic

#include "fusion/semantic/objects/usual_shapes.hpp"

#include <algorithm>
#include <limits>

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
     kNothing},
    // A chair whose seat is hidden, under a table mostly: its back or what is left of it.
    {ObjectKind::chair,
     {0.3, 0.65, 0.08},
     {0.08, 0.6, 0.08},
     {0, 0.5, 0.1},
     {0.72, 1.08, 0.08},
     kNothing,
     {-1, 0.3, 0.06},
     kNothing},
    {ObjectKind::table,
     {0.4, 3, 0.15},
     {0.3, 1.6, 0.1},
     {0, 0.65, 0.1},
     {0.35, 1.2, 0.1},
     {0.33, 1.15, 0.05},
     {0.18, 4.5, 0.08},
     kNothing},
    {ObjectKind::sofa,
     {1.1, 2.8, 0.15},
     {0.6, 1.2, 0.12},
     {0, 0.2, 0.1},
     {0.6, 1.1, 0.08},
     {0.33, 0.55, 0.05},
     {0.35, 2.2, 0.15},
     kNothing},
    {ObjectKind::bed,
     {1.6, 2.4, 0.15},
     {0.8, 2.1, 0.12},
     {0, 0.25, 0.1},
     {0.35, 1.2, 0.1},
     {0.28, 0.75, 0.06},
     {1.1, 4.5, 0.25},
     kNothing},
    {ObjectKind::counter,
     {1.2, 6, 0.2},
     {0.15, 0.9, 0.1},
     {0, 0.2, 0.1},
     {0.8, 1.5, 0.08},
     {0.82, 1.18, 0.05},
     {0.2, 5, 0.2},
     {0.3, 1, 0.15}},
    {ObjectKind::cupboard,
     {0.5, 3.5, 0.12},
     {0.05, 0.85, 0.1},
     {0, 0.25, 0.1},
     {1.15, 3, 0.1},
     kNothing,
     kNothing,
     {0.35, 1, 0.1}},
    {ObjectKind::cupboard,
     {0.5, 2.0, 0.12},
     {0.2, 0.8, 0.1},
     {0, 0.2, 0.1},
     {0.45, 1.2, 0.1},
     {0.4, 1.2, 0.1},
     {0.08, 1.2, 0.15},
     {0.3, 1, 0.1}},
    {ObjectKind::cupboard,
     {0.5, 4, 0.12},
     {0.03, 0.5, 0.08},
     {1.15, 1.8, 0.1},
     {1.8, 2.9, 0.1},
     kNothing,
     kNothing,
     kNothing},
    {ObjectKind::shelf,
     {0.6, 3, 0.12},
     {0.05, 0.5, 0.06},
     {0, 0.25, 0.1},
     {0.9, 3, 0.1},
     kNothing,
     {-1, 0.6, 0.2},
     {0.2, 0.62, 0.08}},
    {ObjectKind::plant,
     {0.25, 1.1, 0.1},
     {0.2, 0.9, 0.1},
     {0, 0.3, 0.1},
     {1.0, 2.2, 0.1},
     kNothing,
     {-1, 0.12, 0.05},
     {0.05, 0.6, 0.1}},
    {ObjectKind::bin,
     {0.18, 0.5, 0.05},
     {0.12, 0.45, 0.05},
     {0, 0.1, 0.06},
     {0.25, 0.85, 0.06},
     kNothing,
     {-1, 0.2, 0.05},
     {0.4, 1, 0.1}},
    {ObjectKind::box,
     {0.3, 1.4, 0.1},
     {0.25, 1.2, 0.08},
     {0, 0.1, 0.06},
     {0.15, 1.25, 0.08},
     {0.15, 1.25, 0.06},
     {0.1, 1.6, 0.08},
     {0.4, 1, 0.1}},
    {ObjectKind::person,
     {0.3, 0.75, 0.08},
     {0.12, 0.55, 0.06},
     {0, 0.3, 0.1},
     {1.45, 2.0, 0.05},
     kNothing,
     {-1, 0.12, 0.05},
     {0.2, 1, 0.1},
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
     Posture::sitting},
    {ObjectKind::person,
     {1.5, 1.95, 0.08},
     {0.35, 0.8, 0.08},
     {0, 0.1, 0.06},
     {0.17, 0.4, 0.04},
     kNothing,
     {-1, 0.6, 0.1},
     {0.3, 1, 0.15},
     Posture::lying},
    {ObjectKind::car,
     {3.0, 5.2, 0.3},
     {1.0, 2.1, 0.2},
     {0, 0.45, 0.1},
     {1.2, 2.1, 0.1},
     kNothing,
     kNothing,
     kNothing},
};

double oddness_for(const ObjectShape& s, const Usual& u) {
  return u.length.penalty(s.length) + u.width.penalty(s.width) + u.bottom.penalty(s.bottom) +
         u.top.penalty(s.top) + u.plate.penalty(s.plate) + u.plate_area.penalty(s.plate_area) +
         u.filled.penalty(s.filled);
}

}  // namespace

double oddness(const ObjectShape& shape, ObjectKind kind, Posture posture) {
  double min_oddness = std::numeric_limits<double>::max();
  for (const Usual& usual : kUsual) {
    if (usual.kind == kind && usual.posture == posture)
      min_oddness = std::min(min_oddness, oddness_for(shape, usual));
  }
  return min_oddness < std::numeric_limits<double>::max() ? min_oddness : 0;
}

}  // namespace parhelion::semantic

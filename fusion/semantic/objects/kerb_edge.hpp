// Measures the edge of a kerb along a line that was proposed for it. Internal to this module.
#pragma once

#include <optional>
#include <span>

#include "fusion/semantic/objects/kerb_lines.hpp"

namespace parhelion::semantic {

constexpr double kKerbReach = 0.6;  ///< m, that either ground must go on for
constexpr double kKerbBin = 0.25;   ///< m, of the edge that is measured at a time

/// A point near a line.
struct EdgePoint {
  double u = 0, v = 0;  ///< m, at the line
  double height = 0;    ///< over the lower ground, as a fraction of the step
  bool ground = false;  ///< by its label
};

struct KerbEdge {
  double offset = 0, slope = 0;  ///< v = offset + slope * u, m
  double from = 0, to = 0;       ///< m, along the line
  double measured = 0;           ///< share of its length
  double low = 0, high = 1;      ///< heights of both grounds at its middle, as fractions of the line's step
};

/// A straight edge by least squares over stretches of kKerbBin. nullopt: shorter than kShortestKerb, not
/// straight, less than half of it measured, or it does not part two grounds.
std::optional<KerbEdge> kerb_edge(const KerbAxis& line, std::span<const EdgePoint> points);

}  // namespace parhelion::semantic

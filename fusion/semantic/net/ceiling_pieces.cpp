#include "fusion/semantic/net/ceiling_pieces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "fusion/semantic/net/net_entities.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kFilled = 0.8;  // of a rectangle that is one box

/// Columns [v0, v1) and rows [u0, u1) of a plane's raster; between the rows of a column everything is
/// covered.
struct Piece {
  int v0 = 0, v1 = 0, u0 = 0, u1 = 0, covered = 0, measured = 0;  ///< the last two in cells
  int area() const { return (v1 - v0) * (u1 - u0); }
  bool is_filled() const { return covered >= kFilled * area(); }
  Piece with(const Piece& o) const {
    return {std::min(v0, o.v0), std::max(v1, o.v1),  std::min(u0, o.u0),
            std::max(u1, o.u1), covered + o.covered, measured + o.measured};
  }
};

/// The whole plane, or, where it is no rectangle, stretches of columns as long as a rectangle fits them.
std::vector<Piece> pieces_of(const InclinedPlane& plane) {
  std::map<int, Piece> columns;
  for (const auto& [cell, points] : plane.cells) {
    const auto [v, u] = cell;
    Piece& column = columns.emplace(v, Piece{v, v + 1, u, u + 1, 1, 0}).first->second;
    column.u1 = u + 1, column.covered = column.area(), ++column.measured;
  }
  std::vector<Piece> pieces;
  Piece all = columns.begin()->second;
  for (const auto& [v, column] : columns) {
    if (!pieces.empty()) all = all.with(column);
    if (!pieces.empty() && pieces.back().with(column).is_filled())
      pieces.back() = pieces.back().with(column);
    else
      pieces.push_back(column);
  }
  return all.is_filled() ? std::vector{all} : pieces;
}

ModelEntity entity_of(const InclinedPlane& plane, const Piece& piece) {
  Eigen::Matrix3d R;
  R << plane.uphill, plane.left, plane.normal;
  const Eigen::AlignedBox2d box =
      Eigen::AlignedBox2d(InclinedPlane::kCell * Eigen::Vector2d(piece.v0, piece.u0),
                          InclinedPlane::kCell * Eigen::Vector2d(piece.v1, piece.u1))
          .intersection(plane.extent);
  const Eigen::Vector3d p = plane.centre + box.center().y() * plane.uphill + box.center().x() * plane.left +
                            0.5 * kSlab * plane.normal;
  ModelEntity entity;
  entity.label = EntityLabel::ceiling;
  entity.T_map_body = Transform<Map, Body>(Eigen::Quaterniond(R), p);
  entity.size = {box.sizes().y(), box.sizes().x(), kSlab};
  entity.observed = static_cast<double>(piece.measured) / piece.area();
  entity.confidence = plane.confidence;
  return entity;
}

}  // namespace

std::vector<ModelEntity> ceiling_pieces(const InclinedPlane& plane) {
  std::vector<ModelEntity> entities;
  for (const Piece& piece : pieces_of(plane)) entities.push_back(entity_of(plane, piece));
  return entities;
}

}  // namespace parhelion::semantic

#include "fusion/semantic/net/inclined_ceilings.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "fusion/cloud/voxel_index.hpp"
#include "fusion/semantic/net/net_entities.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kGentlest = 0.07, kSteepest = 1.31;  // rad, 4 and 75 degrees
constexpr double kCube = 0.4;                         // m; noise of 3 cm leaves its points flat
constexpr double kOnPlane = 0.08;                     // m, of a point or of a cube's centre
constexpr double kTurned = 0.15;                      // rad, between a cube's plane and the region's
constexpr double kMinArea = 1.5, kMinRise = 0.25;     // m^2; m
constexpr double kHeadroom = 1.9;                     // m, as for level ceilings
constexpr double kCell = 0.25;                        // m, of the plane's own raster
constexpr double kSquare = 0.5;                       // m, of the plan
constexpr double kOver = 0.3, kUnder = 0.5;           // m, of what lies over and under a plane
constexpr double kFilled = 0.8;                       // of a rectangle that is one box
constexpr double kFromBelow = 0.6;                    // of a region's points or squares
constexpr int kFewest = 3, kFewOfCube = 8;            // points of a cell or a square; of a cube
constexpr std::uint32_t kNone = ~std::uint32_t{0};
constexpr std::size_t kSamples = 3'000'000;  // points that are measured against planes, of a dense cloud,
constexpr std::size_t kSamplesOfCube = 32;   // but so many of each cube, however large the site is

using Label = EntityLabel;

/// Points of a cube of space, and the plane through them.
struct Cube {
  Eigen::Vector3i at = Eigen::Vector3i::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), mean = Eigen::Vector3d::Zero(),
                  normal = Eigen::Vector3d::UnitZ();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  int count = 0;
  bool flat = false, used = false;
};

struct Plane {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();  ///< unit, upwards
  double off(const Eigen::Vector3d& p) const { return normal.dot(p - centre); }
};

bool is_inclined(const Eigen::Vector3d& normal) {
  const double inclination = std::acos(std::min(1.0, std::abs(normal.z())));
  return inclination > kGentlest && inclination < kSteepest;
}

using Pair = std::pair<int, int>;

/// What was measured in one square of the plan on, over and under a plane.
struct Column {
  int on = 0, over = 0, under = 0;
  double floor = std::numeric_limits<double>::lowest();  ///< m, the highest ground under it
};

/// A plane with coordinates on it: u uphill, v to the left of it, from its centre.
struct Region {
  Plane plane;
  std::vector<std::uint32_t> cubes;
  Eigen::Vector3d uphill = Eigen::Vector3d::UnitX(), left = Eigen::Vector3d::UnitY();
  std::set<Pair> squares;     ///< of the plan, with its cubes
  std::map<Pair, int> cells;  ///< (v, u) of the raster: points on the plane
  std::map<Pair, Column> columns;
  double from_below = 0, placed = 0;  ///< points on it that were seen from below; whose viewpoint is known
  double confidence = 0;
  Eigen::AlignedBox2d extent;  ///< m, (v, u) of the points on it

  void set_axes() {
    uphill = (Eigen::Vector3d::UnitZ() - plane.normal.z() * plane.normal).normalized();
    left = plane.normal.cross(uphill);
  }
  Eigen::Vector2d at(const Eigen::Vector3d& p) const {
    return {left.dot(p - plane.centre), uphill.dot(p - plane.centre)};
  }
  Pair cell_of(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d cell = at(p) / kCell;
    return {static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y()))};
  }
  double height(double u) const { return plane.centre.z() + kCell * u * uphill.z(); }
};

bool may_be_ceiling(std::uint8_t label) {
  return label == static_cast<std::uint8_t>(Label::unknown) ||
         label == static_cast<std::uint8_t>(Label::ceiling);
}

Pair square_of(const Eigen::Vector3d& p) {
  return {static_cast<int>(std::floor(p.x() / kSquare)), static_cast<int>(std::floor(p.y() / kSquare))};
}

/// By square of the plan: the regions whose cubes lie there or in a square beside it.
std::map<Pair, std::vector<std::uint32_t>> squares_of(const std::vector<Region>& regions) {
  std::map<Pair, std::vector<std::uint32_t>> here;
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    for (const auto& [x, y] : regions[r].squares) {
      for (int n = 0; n < 9; ++n) {
        std::vector<std::uint32_t>& there = here[{x + n % 3 - 1, y + n / 3 - 1}];
        if (there.empty() || there.back() != r) there.push_back(r);
      }
    }
  }
  return here;
}

class Finder {
 public:
  Finder(const cloud::PointCloud<Map>& cloud, const SemanticNet& net) : cloud_(cloud), net_(net) {
    for (const Eigen::Vector3f& p : cloud.points) low_ = low_.cwiseMin(p.cast<double>());
    std::vector<double> heights;
    for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / kSamples)
      heights.push_back(static_cast<double>(cloud.points[i].z()));
    floor_ = quantile(heights, 0.005);
    const std::size_t candidates = fill_cubes();
    const std::size_t of_cube = candidates / (kSamplesOfCube * std::max<std::size_t>(1, cubes_.size()));
    stride_ = 1 + std::min(cloud.size() / kSamples, of_cube);
  }

  std::vector<Region> find() {
    std::vector<Region> found;
    for (std::uint32_t seed = 0; seed < cubes_.size(); ++seed) {
      if (cubes_[seed].used || !cubes_[seed].flat || !is_inclined(cubes_[seed].normal)) continue;
      if (auto region = grow(seed)) found.push_back(std::move(*region));
    }
    if (found.empty()) return found;
    measure(found);
    std::erase_if(found, [&](Region& region) { return !is_ceiling(region); });
    return found;
  }

 private:
  /// The number of points in them.
  std::size_t fill_cubes() {
    cloud::VoxelIndex number;
    std::size_t candidates = 0;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      if (!may_be_ceiling(net_.labels[i])) continue;
      const Eigen::Vector3d p = cloud_.points[i].cast<double>();
      const Eigen::Vector3i at = ((p - low_) / kCube).array().floor().cast<int>() + 1;
      if (at.maxCoeff() >= 1 << cloud::VoxelIndex::kBits) continue;
      std::uint32_t& index = number[at];
      if (index == cloud::VoxelIndex::kNone) {
        index = static_cast<std::uint32_t>(cubes_.size());
        cubes_.emplace_back().at = at;
        cubes_.back().mean = p;
      }
      Cube& cube = cubes_[index];
      const Eigen::Vector3d d = p - cube.mean;
      cube.sum += d, cube.squares += d * d.transpose(), ++cube.count, ++candidates;
    }
    for (Cube& cube : cubes_) fit(cube);
    number_ = std::move(number);
    return candidates;
  }
  static void fit(Cube& cube) {
    const Eigen::Vector3d shift = cube.sum / cube.count;
    cube.mean += shift;
    cube.squares = cube.squares / cube.count - shift * shift.transpose();
    if (cube.count < kFewOfCube) return;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(cube.squares);
    const Eigen::Vector3d lambda = solver.eigenvalues();
    cube.flat = lambda[1] > kCube * kCube / 100 && lambda[0] < 0.1 * lambda[1];
    cube.normal = solver.eigenvectors().col(0);
    if (cube.normal.z() < 0) cube.normal = -cube.normal;
  }

  /// The plane through the points of these cubes.
  Plane plane_of(const std::vector<std::uint32_t>& members) const {
    Plane plane;
    double count = 0;
    for (const std::uint32_t i : members)
      plane.centre += cubes_[i].count * cubes_[i].mean, count += cubes_[i].count;
    plane.centre /= count;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const std::uint32_t i : members) {
      const Eigen::Vector3d d = cubes_[i].mean - plane.centre;
      spread += cubes_[i].count * (cubes_[i].squares + d * d.transpose());
    }
    plane.normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
    if (plane.normal.z() < 0) plane.normal = -plane.normal;
    return plane;
  }

  std::optional<Region> grow(std::uint32_t seed) {
    Region region;
    region.plane = {cubes_[seed].mean, cubes_[seed].normal};
    region.cubes = {seed};
    cubes_[seed].used = true;
    std::size_t refit = 8;
    for (std::size_t next = 0; next < region.cubes.size(); ++next) {
      number_.for_each_about(cubes_[region.cubes[next]].at, [&](std::uint32_t k) {
        Cube& cube = cubes_[k];
        if (cube.used || !cube.flat || std::abs(region.plane.off(cube.mean)) > kOnPlane ||
            cube.normal.dot(region.plane.normal) < std::cos(kTurned))
          return;
        cube.used = true;
        region.cubes.push_back(k);
      });
      if (region.cubes.size() >= refit) region.plane = plane_of(region.cubes), refit *= 2;
    }
    constexpr double kCubesOfArea = 0.6;  // a plane cuts more cubes than its area has faces
    if (static_cast<double>(region.cubes.size()) * kCube * kCube < kCubesOfArea * kMinArea)
      return std::nullopt;
    region.plane = plane_of(region.cubes);
    if (!is_inclined(region.plane.normal)) return std::nullopt;
    region.set_axes();
    for (const std::uint32_t i : region.cubes) region.squares.insert(square_of(cubes_[i].mean));
    return region;
  }

  /// Of these regions the one whose plane a point lies on, the nearest one; kNone: it lies on none.
  static std::uint32_t nearest(const std::vector<Region>& regions, const std::vector<std::uint32_t>& here,
                               const Eigen::Vector3d& p) {
    std::uint32_t best = kNone;
    double off = kOnPlane;
    for (const std::uint32_t r : here) {
      if (const double of_region = std::abs(regions[r].plane.off(p)); of_region < off)
        best = r, off = of_region;
    }
    return best;
  }

  /// What lies on, over and under each region, and from where it was seen.
  void measure(std::vector<Region>& regions) const {
    const auto here = squares_of(regions);
    const bool placed = cloud_.scans.size() == cloud_.size() && !cloud_.viewpoints.empty();
    for (std::size_t i = 0; i < cloud_.size(); i += stride_) {
      const Eigen::Vector3d p = cloud_.points[i].cast<double>();
      const auto found = here.find(square_of(p));
      if (found == here.end()) continue;
      const std::uint32_t on = may_be_ceiling(net_.labels[i]) ? nearest(regions, found->second, p) : kNone;
      for (const std::uint32_t r : found->second) {
        Column& column = regions[r].columns[found->first];
        const double above = regions[r].plane.off(p) / regions[r].plane.normal.z();
        column.on += r == on ? 1 : 0;
        column.over += above > kOver ? 1 : 0;
        column.under += above < -kUnder ? 1 : 0;
        if (above < -kUnder && is_ground(static_cast<Label>(net_.labels[i])))
          column.floor = std::max(column.floor, p.z());
      }
      if (on == kNone) continue;
      Region& region = regions[on];
      ++region.cells[region.cell_of(p)];
      region.extent.extend(region.at(p));
      if (!placed || cloud_.scans[i] >= cloud_.viewpoints.size()) continue;
      region.placed += 1;
      region.from_below += region.plane.off(cloud_.viewpoints[cloud_.scans[i]]) < 0 ? 1 : 0;
    }
    for (Region& region : regions)
      std::erase_if(region.cells, [](const auto& c) { return c.second < kFewest; });
  }

  /// Fills in how sure it is.
  bool is_ceiling(Region& region) const {
    if (static_cast<double>(region.cells.size()) * kCell * kCell < kMinArea) return false;
    double seen = 0, overhangs = 0;
    std::vector<double> floors;
    for (const auto& [square, column] : region.columns) {
      if (column.on < kFewest) continue;
      seen += 1;
      overhangs += column.under >= kFewest && 20 * column.over < column.on ? 1 : 0;
      if (column.floor > std::numeric_limits<double>::lowest()) floors.push_back(column.floor);
    }
    region.confidence =
        region.placed > 0 ? region.from_below / region.placed : overhangs / std::max(1.0, seen);
    if (region.confidence < kFromBelow) return false;
    int lowest = std::numeric_limits<int>::max(), highest = std::numeric_limits<int>::min();
    for (const auto& [cell, points] : region.cells)
      lowest = std::min(lowest, cell.second), highest = std::max(highest, cell.second + 1);
    const double floor = floors.empty() ? floor_ : quantile(floors, 0.5);
    return region.height(highest) - region.height(lowest) > kMinRise &&
           region.height(highest) > floor + kHeadroom;
  }

  const cloud::PointCloud<Map>& cloud_;
  const SemanticNet& net_;
  std::size_t stride_ = 1;
  Eigen::Vector3d low_ = Eigen::Vector3d::Constant(std::numeric_limits<double>::max());
  double floor_ = 0;  ///< m, where no floor is known: the lower end of the cloud
  std::vector<Cube> cubes_;
  cloud::VoxelIndex number_;
};

/// Labels the points of these planes; `inclined`: per point, whether it is one of them.
void label_points(const cloud::PointCloud<Map>& cloud, const std::vector<Region>& regions,
                  std::vector<std::uint8_t>& labels, std::vector<bool>& inclined) {
  const auto here = squares_of(regions);
  inclined.assign(cloud.size(), false);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!may_be_ceiling(labels[i])) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const auto found = here.find(square_of(p));
    if (found == here.end()) continue;
    inclined[i] = std::any_of(found->second.begin(), found->second.end(), [&](std::uint32_t r) {
      if (std::abs(regions[r].plane.off(p)) > kOnPlane) return false;
      const auto [v, u] = regions[r].cell_of(p);
      for (int n = 0; n < 9; ++n) {
        if (regions[r].cells.contains({v + n % 3 - 1, u + n / 3 - 1})) return true;
      }
      return false;
    });
    if (inclined[i]) labels[i] = static_cast<std::uint8_t>(Label::ceiling);
  }
}

/// Removes level ceilings at whose height most ceiling points lie on inclined planes.
void drop_level_ones(const cloud::PointCloud<Map>& cloud, const std::vector<bool>& inclined,
                     SemanticNet& net) {
  constexpr double kBand = 0.15, kKept = 0.5;  // m; of its points
  std::vector<const ModelEntity*> level;
  for (const ModelEntity& e : net.entities) {
    if (e.label == Label::ceiling) level.push_back(&e);
  }
  std::vector<double> all(level.size()), kept(level.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (net.labels[i] != static_cast<std::uint8_t>(Label::ceiling)) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    for (std::size_t k = 0; k < level.size(); ++k) {
      const Eigen::Vector3d d = p - level[k]->T_map_body.translation();
      if (std::abs(d.z() + level[k]->size.z() / 2) > kBand ||
          (d.head<2>().cwiseAbs() - 0.5 * level[k]->size.head<2>()).maxCoeff() > 0.1)
        continue;
      all[k] += 1, kept[k] += inclined[i] ? 0 : 1;
    }
  }
  std::set<std::string> gone;
  for (std::size_t k = 0; k < level.size(); ++k) {
    if (all[k] > 0 && kept[k] < kKept * all[k]) gone.insert(level[k]->name);
  }
  std::erase_if(net.entities, [&](const ModelEntity& e) { return gone.contains(e.name); });
  std::erase_if(net.evidence, [&](const LabelEvidence& e) { return gone.contains(e.entity); });
  const auto names_gone = [&](const Relation& r) { return gone.contains(r.from) || gone.contains(r.to); };
  std::erase_if(net.relations, names_gone);
  for (LabelEvidence& evidence : net.evidence) std::erase_if(evidence.supports, names_gone);
}

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
std::vector<Piece> pieces_of(const Region& region) {
  std::map<int, Piece> columns;
  for (const auto& [cell, points] : region.cells) {
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

ModelEntity entity_of(const Region& region, const Piece& piece) {
  Eigen::Matrix3d R;
  R << region.uphill, region.left, region.plane.normal;
  const Eigen::AlignedBox2d box = Eigen::AlignedBox2d(kCell * Eigen::Vector2d(piece.v0, piece.u0),
                                                      kCell * Eigen::Vector2d(piece.v1, piece.u1))
                                      .intersection(region.extent);
  const Eigen::Vector3d p = region.plane.centre + box.center().y() * region.uphill +
                            box.center().x() * region.left + 0.5 * kSlab * region.plane.normal;
  ModelEntity entity;
  entity.label = Label::ceiling;
  entity.T_map_body = Transform<Map, Body>(Eigen::Quaterniond(R), p);
  entity.size = {box.sizes().y(), box.sizes().x(), kSlab};
  entity.observed = static_cast<double>(piece.measured) / piece.area();
  entity.confidence = region.confidence;
  return entity;
}

}  // namespace

void add_inclined_ceilings(const cloud::PointCloud<Map>& cloud, SemanticNet& net) {
  const std::vector<Region> regions = Finder(cloud, net).find();
  if (regions.empty()) return;
  std::vector<bool> inclined;
  label_points(cloud, regions, net.labels, inclined);
  int number = 0;
  for (const ModelEntity& e : net.entities) number += e.label == Label::ceiling ? 1 : 0;
  drop_level_ones(cloud, inclined, net);
  for (const Region& region : regions) {
    const std::string name = "ceiling " + std::to_string(++number);
    const std::vector<Piece> pieces = pieces_of(region);
    for (std::size_t k = 0; k < pieces.size(); ++k) {
      ModelEntity& entity = net.entities.emplace_back(entity_of(region, pieces[k]));
      entity.name = pieces.size() == 1 ? name : name + "." + std::to_string(k + 1);
      if (pieces.size() > 1) entity.part_of = name;
    }
  }
}

}  // namespace parhelion::semantic

#include "fusion/semantic/texture/movers.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/texture/depth_blocks.hpp"

namespace parhelion::semantic {
namespace {

constexpr int kWitnesses = 2;           ///< images that must see through
constexpr std::size_t kMinBlocks = 12;  ///< of a mover in an image; fewer are noise at edges
constexpr int kGrowth = 24;             ///< blocks
constexpr float kOneBody = 0.05F;       ///< share of the depth between neighbouring blocks of one body

std::vector<float> metres(const DepthView& view, double farthest) {
  std::vector<float> depth;
  depth.reserve(view.millimetres.size());
  for (const std::uint16_t mm : view.millimetres) {
    const double z = mm * 1e-3;
    depth.push_back(z > farthest ? 0 : static_cast<float>(z));
  }
  return depth;
}

struct Witness {
  const DepthView& view;
  Eigen::Isometry3d T_optical_map;
  DepthBlocks blocks;
};

Eigen::Vector3d ray_of(const Pinhole& camera, int column, int row) {
  return {(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, 1};
}

double tolerance_at(double z, const MoverOptions& options) {
  return options.tolerance + options.tolerance_of_depth * z;
}

/// Whether something at this depth is neither at the surface nor hidden by its edges.
bool is_off(const DepthBlocks::Range& surface, double z, const MoverOptions& options) {
  const double tolerance = tolerance_at(z, options);
  return surface.measured() && (z < surface.nearest - tolerance || z > surface.farthest + tolerance);
}

/// How often others measured a place, and how often they saw through it.
struct Votes {
  int agree = 0, through = 0;
};

Votes votes_on(const Eigen::Vector3d& p_map, std::size_t self, std::span<const Witness> witnesses,
               std::size_t stride, const MoverOptions& options) {
  Votes votes;
  for (std::size_t w = self % stride; w < witnesses.size(); w += stride) {
    if (w == self) continue;
    const Witness& witness = witnesses[w];
    const Eigen::Vector3d p = witness.T_optical_map * p_map;
    if (p.z() < 0.1) continue;
    const Eigen::Vector2d pixel = witness.view.camera.project(p);
    if (!witness.view.camera.contains(pixel)) continue;
    const DepthBlocks::Range& range = witness.blocks.around(pixel);
    const double tolerance = tolerance_at(p.z(), options);
    if (!range.measured() || range.farthest < p.z() - tolerance) continue;
    (range.nearest > p.z() + tolerance ? votes.through : votes.agree) += 1;
  }
  return votes;
}

/// The middle of a block of a depth image.
struct Place {
  float depth = 0;  ///< m; 0: nothing was measured
  Votes votes;

  bool passing() const { return votes.through >= kWitnesses && votes.through > votes.agree; }
  /// Too few saw the place to call it a part of the site.
  bool unconfirmed() const { return depth > 0 && (votes.agree < kWitnesses || votes.agree <= votes.through); }
};

std::vector<Place> places_of(std::size_t self, std::span<const Witness> witnesses,
                             const MoverOptions& options) {
  const Witness& view = witnesses[self];
  const Pinhole& camera = view.view.camera;
  const std::size_t stride = std::max<std::size_t>(1, witnesses.size() / options.max_witnesses);
  std::vector<Place> places(view.blocks.blocks());
  const int half = view.blocks.step() / 2;
  for (int row = half; row < camera.height; row += view.blocks.step()) {
    for (int column = half; column < camera.width; column += view.blocks.step()) {
      const double z = view.view.millimetres[camera.at(column, row)] * 1e-3;
      if (z <= 0 || z > options.farthest) continue;
      const Eigen::Vector3d p_map =
          view.view.T_map_optical * Eigen::Vector3d(z * ray_of(camera, column, row));
      places[view.blocks.block_of(column, row)] = {static_cast<float>(z),
                                                   votes_on(p_map, self, witnesses, stride, options)};
    }
  }
  return places;
}

/// Adds what nobody else saw and that is one body with what is marked: a head, or feet.
void grow(std::vector<std::uint8_t>& marked, const std::vector<Place>& places, const DepthBlocks& blocks) {
  std::vector<std::size_t> front, next;
  for (std::size_t i = 0; i < marked.size(); ++i)
    if (marked[i] != 0) front.push_back(i);
  for (int step = 0; step < kGrowth; ++step, front.swap(next)) {
    next.clear();
    for (const std::size_t from : front) {
      blocks.each_neighbour(from, [&](std::size_t to) {
        const float near = places[from].depth, far = places[to].depth;
        if (marked[to] != 0 || !places[to].unconfirmed() || std::abs(near - far) > kOneBody * near) return;
        marked[to] = 1;
        next.push_back(to);
      });
    }
  }
}

std::vector<std::uint8_t> passing_in(std::size_t self, std::span<const Witness> witnesses,
                                     const MoverOptions& options) {
  const DepthBlocks& blocks = witnesses[self].blocks;
  const std::vector<Place> places = places_of(self, witnesses, options);
  std::vector<std::uint8_t> marked(places.size());
  std::transform(places.begin(), places.end(), marked.begin(),
                 [](const Place& place) { return place.passing(); });
  drop_small_groups(marked, blocks, kMinBlocks);
  grow(marked, places, blocks);
  widen(marked, blocks);
  return pixels_of(marked, blocks, witnesses[self].view.camera);
}

}  // namespace

std::vector<std::vector<std::uint8_t>> passing(std::span<const DepthView> views,
                                               const MoverOptions& options) {
  std::vector<Witness> witnesses;
  for (const DepthView& view : views)
    witnesses.push_back(
        {view, view.T_map_optical.inverse().isometry(), DepthBlocks(view.camera, metres(view, 65))});
  std::vector<std::vector<std::uint8_t>> masks(views.size());
  cloud::for_each_chunk(views.size(), 1, options.threads, [&](std::size_t i, std::size_t, std::size_t) {
    masks[i] = passing_in(i, witnesses, options);
  });
  return masks;
}

namespace {

/// The pixels of a colour image that lie between neighbouring ones of a depth image.
int pixels_between(const Pinhole& colour, const Pinhole& depth) {
  return static_cast<int>(std::ceil(std::max(colour.fx / depth.fx, colour.fy / depth.fy)));
}

/// Where the depth image measured nothing of the surface in its view.
std::vector<std::uint8_t> holes_of(const DepthView& depth, const std::vector<std::uint8_t>& measured,
                                   const DepthBlocks& blocks, const ViewGeometry& geometry) {
  std::vector<std::uint8_t> hole(measured.size());
  const Eigen::Isometry3d T_depth_colour =
      (geometry.T_optical_map * depth.T_map_optical.isometry()).inverse(Eigen::Isometry);
  const int half = blocks.step() / 2;
  for (int row = half; row < geometry.camera.height; row += blocks.step()) {
    for (int column = half; column < geometry.camera.width; column += blocks.step()) {
      const std::size_t block = blocks.block_of(column, row);
      const auto z = static_cast<double>(geometry.depth[geometry.camera.at(column, row)]);
      if (measured[block] != 0 || z <= 0) continue;
      const Eigen::Vector3d p = T_depth_colour * Eigen::Vector3d(z * ray_of(geometry.camera, column, row));
      hole[block] = p.z() > 0.1 && depth.camera.contains(depth.camera.project(p)) ? 1 : 0;
    }
  }
  return hole;
}

/// Unmarks holes where most other images measured nothing either: dark and shining surfaces.
void leave_usual_holes(std::vector<std::uint8_t>& hole, const DepthBlocks& blocks,
                       const ViewGeometry& geometry, std::span<const DepthView> others,
                       const MoverOptions& options) {
  std::vector<int> votes(hole.size());
  const Eigen::Isometry3d T_map_optical = geometry.T_optical_map.inverse(Eigen::Isometry);
  const std::size_t stride = std::max<std::size_t>(1, others.size() / options.max_witnesses);
  const int half = blocks.step() / 2;
  for (std::size_t i = 0; i < others.size(); i += stride) {
    const Eigen::Isometry3d T_other_optical = others[i].T_map_optical.inverse().isometry() * T_map_optical;
    for (int row = half; row < geometry.camera.height; row += blocks.step()) {
      for (int column = half; column < geometry.camera.width; column += blocks.step()) {
        const auto z = static_cast<double>(geometry.depth[geometry.camera.at(column, row)]);
        const std::size_t block = blocks.block_of(column, row);
        if (hole[block] == 0 || z <= 0) continue;
        const Eigen::Vector3d p = T_other_optical * Eigen::Vector3d(z * ray_of(geometry.camera, column, row));
        if (p.z() < 0.1) continue;
        const Eigen::Vector2d pixel = others[i].camera.project(p);
        if (!others[i].camera.contains(pixel)) continue;
        const double measured = others[i].millimetres[others[i].camera.at(
                                    static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5))] *
                                1e-3;
        if (measured <= 0)
          --votes[block];
        else if (std::abs(measured - p.z()) < tolerance_at(p.z(), options))
          ++votes[block];
      }
    }
  }
  for (std::size_t i = 0; i < hole.size(); ++i) hole[i] = hole[i] != 0 && votes[i] > 0 ? 1 : 0;
}

}  // namespace

std::vector<Witnessed> compare_depth(const ViewGeometry& geometry, const DepthView& depth,
                                     std::span<const std::uint8_t> mover, std::span<const DepthView> others,
                                     const MoverOptions& options) {
  const Pinhole& camera = geometry.camera;
  const DepthBlocks surface(camera, geometry.depth, pixels_between(camera, depth.camera));
  std::vector<std::uint8_t> measured(surface.blocks()), contradicts(surface.blocks()),
      moving(surface.blocks());
  const Eigen::Isometry3d T_colour_depth = geometry.T_optical_map * depth.T_map_optical.isometry();
  // In pixels of the depth image, which may be coarser than the colour image.
  const int step = std::max(1, static_cast<int>(0.5 * surface.step() * depth.camera.fx / camera.fx));
  for (int row = 0; row < depth.camera.height; row += step) {
    for (int column = 0; column < depth.camera.width; column += step) {
      const std::size_t at = depth.camera.at(column, row);
      const double z = depth.millimetres[at] * 1e-3;
      if (z <= 0) continue;
      const Eigen::Vector3d p = T_colour_depth * Eigen::Vector3d(z * ray_of(depth.camera, column, row));
      if (p.z() < 0.1) continue;
      const Eigen::Vector2d pixel = camera.project(p);
      if (!camera.contains(pixel)) continue;
      const std::size_t block =
          surface.block_of(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5));
      measured[block] = 1;
      moving[block] |= mover[at];
      if (p.z() <= options.farthest && is_off(surface.around(pixel), p.z(), options)) contradicts[block] = 1;
    }
  }
  drop_small_groups(contradicts, surface, kMinBlocks);
  for (std::size_t i = 0; i < contradicts.size(); ++i) contradicts[i] |= moving[i];
  widen(contradicts, surface);
  widen(measured, surface);
  std::vector<std::uint8_t> hole = holes_of(depth, measured, surface, geometry);
  leave_usual_holes(hole, surface, geometry, others, options);
  std::vector<Witnessed> result(camera.pixels());
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column) {
      const std::size_t block = surface.block_of(column, row);
      if (hole[block] != 0) result[camera.at(column, row)] = Witnessed::unmeasured;
      if (contradicts[block] != 0) result[camera.at(column, row)] = Witnessed::contradicts;
    }
  }
  return result;
}

}  // namespace parhelion::semantic

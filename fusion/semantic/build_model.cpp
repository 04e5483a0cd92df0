#include "fusion/semantic/build_model.hpp"

#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <iterator>
#include <optional>
#include <sstream>
#include <utility>

#include "fusion/semantic/net/drop_doubles.hpp"
#include "fusion/semantic/net/find_ramps.hpp"
#include "fusion/semantic/net/inclined_ceilings.hpp"
#include "fusion/semantic/net/net_graph.hpp"
#include "fusion/semantic/net/observed_floors.hpp"
#include "fusion/semantic/net/sagging_floors.hpp"
#include "fusion/semantic/objects/find_kerbs.hpp"
#include "fusion/semantic/spread_voxels.hpp"
#include "fusion/semantic/stray_points.hpp"
#include "fusion/semantic/unit_doubt.hpp"
#include "fusion/semantic/upside_down.hpp"
#include "protocols/length_text.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kHighestRoom = 100;     ///< m, of a cloud: a larger height indicates a wrong unit
constexpr double kLowestRoom = 0.5;      ///< m: a smaller one indicates a wrong unit or no building
constexpr std::size_t kMaxMeshes = 900;  ///< of objects; others are in the mesh of unknown things
constexpr double kNoSteps = 0.08;        ///< m, of voxels: half of a usual rise
constexpr double kStray = 50;            ///< m, and a quarter of the site: points farther out are outliers

/// Heights between which 98 % of the points lie, so that outliers do not affect the check of the unit.
Eigen::AlignedBox3d extent_of(const cloud::PointCloud<Cloud>& cloud) {
  Eigen::AlignedBox3d extent;
  const std::size_t stride = std::max<std::size_t>(1, cloud.size() / 20'000);
  std::array<std::vector<float>, 3> sample;
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      sample[axis].push_back(cloud.points[i][static_cast<Eigen::Index>(axis)]);
  }
  Eigen::Vector3d low, high;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto outliers = static_cast<std::ptrdiff_t>(sample[axis].size() / 100);
    const auto first = sample[axis].begin() + outliers, last = sample[axis].end() - 1 - outliers;
    std::nth_element(sample[axis].begin(), first, sample[axis].end());
    low[static_cast<Eigen::Index>(axis)] = static_cast<double>(*first);
    std::nth_element(first, last, sample[axis].end());
    high[static_cast<Eigen::Index>(axis)] = static_cast<double>(*last);
  }
  return {low, high};
}

Status check_size(const Eigen::AlignedBox3d& extent, double max_extent, std::vector<std::string>& notes) {
  constexpr double kMillimetre = 1e-3;           // m
  constexpr double kFar = 1e4, kFarthest = 1e5;  // m: single precision is 1 mm and 1 cm there
  const Eigen::Vector3d size = extent.sizes();
  const auto fits = [&](double unit) {
    return unit * size.maxCoeff() <= max_extent && unit * size.z() <= kHighestRoom;
  };
  if (!fits(1)) {
    return Error{
        "the cloud is " + length_text(size.x()) + " by " + length_text(size.y()) + " and " +
        length_text(size.z()) +
        (fits(kMillimetre)
             ? " high: is its unit millimetres or centimetres? Use --unit mm or --unit cm, or --unit in "
               "for inches"
             : " high: too large for a site in any unit; some of its points may be damaged")};
  }
  if (size.z() < kLowestRoom && size.maxCoeff() < 10 * kLowestRoom) {
    notes.push_back("the cloud is only " + length_text(size.maxCoeff()) + " large and " +
                    length_text(size.z()) + " high: is its unit larger than a metre?");
  }
  if (const double away = extent.center().norm(); away > kFar) {
    const std::string far = "the cloud is " + length_text(away) +
                            " from its origin, where single precision rounds places to " +
                            length_text(away * 0x1p-24) + ": subtract an offset from its coordinates";
    if (away > kFarthest) return Error{far};
    notes.push_back(far);
  }
  return {};
}

template <class Column>
void keep_marked(const std::vector<bool>& keep, Column& column) {
  if (column.empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i]) column[kept++] = column[i];
  }
  column.resize(kept);
}

template <class Frame>
void keep_marked(const std::vector<bool>& keep, cloud::PointCloud<Frame>& cloud) {
  keep_marked(keep, cloud.points);
  keep_marked(keep, cloud.normals);
  keep_marked(keep, cloud.colours);
  keep_marked(keep, cloud.labels);
  keep_marked(keep, cloud.scans);
}

/// A single erroneous return must not enlarge the plan a thousand times.
void leave_out_far(const Eigen::AlignedBox3d& extent, cloud::PointCloud<Cloud>& cloud, BuiltModel& built) {
  const double margin = kStray + 0.25 * extent.sizes().maxCoeff();
  const Eigen::AlignedBox3f bounds((extent.min().array() - margin).matrix().cast<float>(),
                                   (extent.max().array() + margin).matrix().cast<float>());
  std::vector<bool> keep(cloud.size());
  std::size_t strays = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    keep[i] = bounds.contains(cloud.points[i]);
    strays += keep[i] ? 0 : 1;
  }
  if (strays == 0) return;
  built.left_out = keep;
  built.left_out.flip();
  keep_marked(keep, cloud);
  built.notes.push_back(std::to_string(strays) + " points left out: more than " + length_text(margin) +
                        " away from the site");
}

/// `why`: what the points are.
template <class Frame>
void leave_out(std::vector<bool>&& marked, const std::string& why, cloud::PointCloud<Frame>& cloud,
               BuiltModel& built) {
  const auto count = std::count(marked.begin(), marked.end(), true);
  std::vector<bool>& left_out = built.left_out;
  left_out.resize(left_out.empty() ? marked.size() : left_out.size());
  for (std::size_t i = 0, k = 0; i < left_out.size(); ++i) {
    if (!left_out[i]) left_out[i] = marked[k++];
  }
  std::ostringstream words;
  words << count << " points left out (" << std::setprecision(2)
        << 100 * static_cast<double>(count) / static_cast<double>(marked.size()) << " %): " << why;
  built.notes.push_back(words.str());
  marked.flip();
  keep_marked(marked, cloud);
}

/// The cloud with points over its voxels, where it is a voxel map or too sparse. Leaves strays
/// out first, but of voxel maps: there strays are as close together as voxels.
std::optional<SpreadCloud> clean_and_spread(cloud::PointCloud<Cloud>& cloud, const ModelOptions& options,
                                            BuiltModel& built) {
  const std::optional<double> voxels = options.spacing ? options.spacing : voxel_spacing(cloud);
  std::optional<double> sparse;
  if (voxels) {
    built.notes.push_back(
        "points are " + length_text(*voxels) +
        " apart everywhere: taken for a voxel map, heights and edges are known to half of that");
    if (*voxels > kNoSteps)
      built.notes.push_back(
          "a step is at most two voxels high: stairs are seldom found in this map, and are not "
          "in the model then; make one of 5 cm, or draw them");
  } else {
    std::vector<bool> strays;
    tbb::parallel_invoke([&] { strays = stray_points(cloud); }, [&] { sparse = sparse_spacing(cloud); });
    if (!strays.empty()) {
      // Dust and mixed pixels must not become walls that cross a room.
      leave_out(std::move(strays), "strays that lie on no surface", cloud, built);
      sparse = sparse_spacing(cloud);
    }
  }
  if (sparse) {
    built.notes.push_back("points are up to " + length_text(*sparse) +
                          " apart on most surfaces: gaps up to that are taken for surface");
  } else if (!voxels) {
    return std::nullopt;
  }
  SpreadCloud spread = spread_voxels(cloud, voxels ? *voxels : *sparse, options.segmentation.threads);
  spread.voxel = voxels.value_or(0);
  return spread;
}

/// In place: a cloud of fifty million points must not be copied.
cloud::PointCloud<Map> placed(cloud::PointCloud<Cloud>&& cloud, const Transform<Map, Cloud>& T_map_cloud) {
  cloud::PointCloud<Map> result{std::move(cloud.points),  std::move(cloud.normals),
                                std::move(cloud.colours), std::move(cloud.labels),
                                std::move(cloud.scans),   std::move(cloud.viewpoints)};
  const Eigen::Matrix3f R = T_map_cloud.rotation().cast<float>();
  const Eigen::Vector3f p = T_map_cloud.translation().cast<float>();
  for (Eigen::Vector3f& point : result.points) point = R * point + p;
  for (Eigen::Vector3f& normal : result.normals) normal = R * normal;
  for (Eigen::Vector3d& viewpoint : result.viewpoints) viewpoint = T_map_cloud * viewpoint;
  return result;
}

void raise(BuiltModel& built, double by) {
  const Eigen::Vector3d up(0, 0, by);
  for (ModelEntity& entity : built.model.entities) entity.T_map_body = entity.T_map_body.moved_by(up);
  for (ModelMesh& mesh : built.model.meshes) {
    for (Eigen::Vector3f& vertex : mesh.vertices) vertex.z() += static_cast<float>(by);
  }
  for (ModelObject& object : built.objects) object.T_map_body = object.T_map_body.moved_by(up);
  for (Eigen::Vector3f& point : built.cloud.points) point.z() += static_cast<float>(by);
  for (Eigen::Vector3d& viewpoint : built.cloud.viewpoints) viewpoint.z() += by;
  for (Mirror& mirror : built.mirrors) {
    for (double* height : {&mirror.low, &mirror.high, &mirror.floor, &mirror.ceiling}) *height += by;
  }
  built.model.T_map_cloud = built.model.T_map_cloud.moved_by(up);
  built.shift = by;
}

/// Finds mirrors. What rays show to be an image is left out, and the rest is segmented again; other images
/// become doubts.
Status leave_out_images(const cloud::PointCloud<Map>& surfaces_of, const ModelOptions& options,
                        Segmentation& segmentation, BuiltModel& built) {
  built.mirrors = find_mirrors(surfaces_of, segmentation);
  if (&surfaces_of != &built.cloud) {
    for (Mirror& mirror : built.mirrors) mirror.certain = false;
    return {};
  }
  std::vector<bool> images = seen_in_mirrors(built.cloud, built.mirrors);
  if (images.empty()) return {};
  std::string places;
  for (const Mirror& mirror : built.mirrors) {
    if (!mirror.certain) continue;
    const Eigen::Vector2d middle = mirror.at + 0.5 * (mirror.from + mirror.to) * mirror.along();
    places += (places.empty() ? "" : " and ") + length_text(mirror.to - mirror.from) +
              " wide at x = " + length_text(middle.x()) + ", y = " + length_text(middle.y());
  }
  leave_out(std::move(images), "images in a mirror " + places, built.cloud, built);
  auto again = options.method == SegmentationMethod::normals
                   ? segment_by_normals(built.cloud, options.segmentation)
                   : segment(built.cloud, options.segmentation);
  if (!again) return again.error();
  segmentation = std::move(*again);
  return {};
}

Result<BuiltModel> build(cloud::PointCloud<Cloud> cloud, const ModelOptions& options,
                         const std::function<void(const char*, int)>& progress) {
  const auto begin = [&](const char* stage, int done) {
    if (progress) progress(stage, done);
  };
  if (cloud.empty()) return Error{"the cloud has no points"};
  BuiltModel built;
  const Eigen::AlignedBox3d extent = extent_of(cloud);
  if (Status status = check_size(extent, options.max_extent, built.notes); !status) return status.error();
  // In a stairwell, too, scanners stand as far from a wall and at many heights.
  if (!options.up && has_y_upwards(cloud) && !saw_overhead(cloud, Eigen::Vector3d::UnitZ())) {
    return Error{"the cloud seems to have its y axis upwards: the " +
                 std::to_string(cloud.viewpoints.size()) +
                 " scanners stood at one height along y, and not along z; turn it, or give the up direction" +
                 options.up_advice};
  }
  leave_out_far(extent, cloud, built);
  begin("level", 0);
  std::optional<SpreadCloud> spread = clean_and_spread(cloud, options, built);
  UpDoubt up;
  const auto T_map_cloud = level(spread ? spread->cloud : cloud,
                                 options.up.value_or(Eigen::Vector3d::UnitZ()), options.up.has_value(), &up);
  if (!T_map_cloud) return Error{T_map_cloud.error().message + (up.refused ? options.up_advice : "")};
  built.up_doubtful = !up.note.empty();
  if (built.up_doubtful)
    built.notes.push_back(up.note + ": look at the model, and give the up direction" + options.up_advice);
  built.model.T_map_cloud = *T_map_cloud;
  built.cloud = placed(std::move(cloud), *T_map_cloud);
  begin("segment", 1);
  cloud::PointCloud<Map> dense;
  if (spread) dense = placed(std::move(spread->cloud), *T_map_cloud);
  const cloud::PointCloud<Map>& surfaces_of = spread ? dense : built.cloud;
  auto segmentation = options.method == SegmentationMethod::normals
                          ? segment_by_normals(surfaces_of, options.segmentation)
                          : segment(surfaces_of, options.segmentation);
  if (!segmentation) return segmentation.error();
  if (Status left = leave_out_images(surfaces_of, options, *segmentation, built); !left) return left.error();
  begin("label", 2);
  SemanticNetOptions net_options = options.net;
  if (spread) net_options.voxel = spread->voxel;
  auto net = label_entities(surfaces_of, *segmentation, net_options);
  if (!net) return net.error();
  FoundRamps found_ramps = find_ramps(surfaces_of, net->labels, spread ? spread->voxel : 0);
  add_landings(*segmentation, found_ramps, *net);
  add_inclined_ceilings(surfaces_of, *net);
  std::move(found_ramps.ramps.begin(), found_ramps.ramps.end(), std::back_inserter(net->entities));
  if (spread) net->labels = labels_of_parents(*spread, net->labels, built.cloud.size());
  built.net = std::move(*net);
  if (const std::string& stages = options.segmentation.stages; !stages.empty()) {
    if (Status written = write_net(built.net, stages); !written) return written.error();
  }
  segmentation = Segmentation{};  // frees its memory
  built.model.entities = std::move(built.net.entities);
  built.model.relations = std::move(built.net.relations);
  if (const std::size_t doubles = drop_doubles(built.model); doubles > 0)
    built.notes.push_back(std::to_string(doubles) + " entities left out: duplicates of more certain ones");
  built.cloud.labels = std::move(built.net.labels);
  join_sagging_floors(built.cloud, built.model);
  begin("mesh", 3);
  EvidenceOptions evidence = options.evidence;
  evidence.asked = heights_of_floors(built.model, evidence.cube);
  cut_floors(EvidenceGrid(built.cloud, evidence), built.model);
  FoundObjects found = find_objects(built.cloud, built.cloud.labels, built.model.entities, options.objects);
  const std::size_t meshed = std::min(found.objects.size(), kMaxMeshes);
  std::optional<Result<UnknownMesh>> meshing;
  std::vector<ModelObject> kerbs;
  const auto floor = ground_floor(built.model);
  tbb::parallel_invoke(
      [&] { meshing = unknown_mesh(built.cloud, built.cloud.labels, options.mesh, found.object_of, meshed); },
      [&] { built.heights = site_heights(built.cloud, floor, largest_ceiling(built.model)); },
      [&] {
        kerbs = find_kerbs(built.cloud, built.cloud.labels, built.model.entities, spread ? spread->voxel : 0);
      });
  Result<UnknownMesh>& mesh = *meshing;
  if (!mesh) return mesh.error();
  for (std::size_t o = 0; o < meshed; ++o) {
    if (mesh->of_owner[o].empty()) continue;
    mesh->of_owner[o].name = found.objects[o].name;
    built.model.meshes.push_back(std::move(mesh->of_owner[o]));
  }
  built.objects = std::move(found.objects);
  built.object_features = std::move(found.features);
  built.object_of = std::move(found.object_of);
  std::move(kerbs.begin(), kerbs.end(), std::back_inserter(built.objects));
  if (mesh->cube > options.mesh.cube * 1.001)
    built.notes.push_back("the mesh of unknown objects has cubes of " + length_text(mesh->cube) +
                          " to limit its size");
  if (!mesh->mesh.empty()) built.model.meshes.push_back(std::move(mesh->mesh));
  begin("finish", 4);
  built.floor = floor.value_or(0);
  if (const std::string& stages = options.segmentation.stages; !stages.empty()) {
    if (Status written = write_heights(built.cloud, built.model.T_map_cloud, built.heights, stages); !written)
      return written.error();
  }
  if (options.floor_to_zero) {
    if (!floor) return Error{"--floor-to-zero: no floor was found in the cloud"};
    raise(built, -*floor);
  }
  return built;
}

/// A hall without a door may be a room in feet: a part of its points in that unit tells.
void doubt_unit(const ModelOptions& options, BuiltModel& built) {
  constexpr std::size_t kEnough = 250'000;  // points: a room has ten times as many a square metre as a hall
  const std::optional<OtherUnit> unit = unit_to_try(built.model);
  if (!unit) return;
  cloud::PointCloud<Cloud> part;
  const std::size_t step = 1 + built.cloud.size() / kEnough;
  for (std::size_t i = 0; i < built.cloud.size(); i += step) {
    part.points.push_back(built.cloud.points[i] * static_cast<float>(unit->metres));
    if (!built.cloud.scans.empty()) part.scans.push_back(built.cloud.scans[i]);
  }
  for (const Eigen::Vector3d& viewpoint : built.cloud.viewpoints)
    part.viewpoints.push_back(unit->metres * viewpoint);
  ModelOptions other = options;
  other.up = Eigen::Vector3d::UnitZ();
  other.segmentation.stages.clear();
  other.floor_to_zero = false;
  other.spacing.reset();
  const auto in_other = build(std::move(part), other, {});
  if (!in_other || !fits_people(in_other->model)) return;
  std::ostringstream words;
  words << "its unit may be " << unit->name << " (" << unit->metres << " m)";
  built.notes.push_back(words.str() + ": there are no doors and stairs in metres, and there are in " +
                        unit->name + options.unit_advice);
  built.unit_doubt = words.str() + options.unit_advice;
}

}  // namespace

Result<BuiltModel> build_model(cloud::PointCloud<Cloud> cloud, const ModelOptions& options,
                               const std::function<void(const char*, int)>& progress) {
  if (options.segmentation.threads < 0) return Error{"threads must not be negative"};
  // All loops within it use these threads.
  tbb::task_arena arena(options.segmentation.threads == 0 ? tbb::task_arena::automatic
                                                          : options.segmentation.threads);
  return arena.execute([&] {
    auto built = build(std::move(cloud), options, progress);
    if (built && !options.unit_known) doubt_unit(options, *built);
    return built;
  });
}

}  // namespace parhelion::semantic

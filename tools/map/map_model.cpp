// `parhelion map model`: the semantic model of a site from a registered cloud.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <memory>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/cloud/write_cloud.hpp"
#include "fusion/pose/maps/grid_map.hpp"
#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/keep_corrections.hpp"
#include "fusion/semantic/model_quality.hpp"
#include "fusion/semantic/slice.hpp"
#include "tools/command_line.hpp"
#include "tools/map/cloud_file_names.hpp"
#include "tools/map/gltf.hpp"
#include "tools/map/map_commands.hpp"
#include "tools/map/model_pictures.hpp"
#include "tools/map/model_summary.hpp"
#include "tools/progress.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDescription = "Make a semantic model of a site from a registered 3D cloud";
constexpr const char* kFooter =
    "Examples:\n  parhelion map model room.ply -o room.yaml --picture room.png --summary room.json\n"
    "  parhelion map model room.ply -o room.yaml --floor-to-zero --slice room --force\n\n"
    "Walls, doors, floor, ceiling, stairs become boxes with their relations, furniture objects with a mesh "
    "each. The model can "
    "be "
    "corrected\nby hand: `locked: true` keeps an entity as it is, `deleted: true` takes it away, `virtual: "
    "true` "
    "draws one that no\nlaser sees. A new run over the same MODEL (--force), or with --keep OLD, keeps "
    "these.";

struct Arguments {
  std::string cloud, output, keep, gltf, picture, summary, slice, labelled;
  double slice_height = 0.3, memory = 0;
  bool flip = false, no_flip = false;
  cloud::ReadOptions read;
  semantic::ModelOptions model;
  bool overwrite = false;
};

/// Peak memory in bytes per point besides the cloud, measured at 50 million points (bench_semantic_model).
constexpr std::uint64_t kWorkPerPoint = 36;

void print_note(const std::string& note) { std::fprintf(stderr, "parhelion map model: %s\n", note.c_str()); }

/// Called before the work begins.
Status check_outputs(const Arguments& a) {
  std::vector<std::string> paths = {a.output, a.gltf, a.picture, a.summary, a.labelled};
  if (!a.slice.empty()) {
    paths.push_back(a.slice + ".yaml");
    paths.push_back(a.slice + ".pgm");
  }
  for (const std::string& path : paths) {
    if (const Status free = check_writable(path, a.overwrite); !free) return free;
  }
  const auto ends = [](const std::string& path, const char* extension) {
    return path.empty() || fs::path(path).extension() == extension;
  };
  if (!ends(a.picture, ".png")) return Error{a.picture + ": expected a name that ends in .png"};
  if (!ends(a.gltf, ".gltf")) return Error{a.gltf + ": expected a name that ends in .gltf"};
  if (!ends(a.labelled, ".ply")) return Error{a.labelled + ": the labelled cloud is written as .ply"};
  return {};
}

/// The model whose corrections are to be kept, if there is one.
Result<std::optional<SemanticModel>> old_model(const Arguments& a) {
  std::error_code ignored;
  const bool again = a.keep.empty() && a.output != "-" && fs::exists(a.output, ignored);
  if (a.keep.empty() && !again) return std::optional<SemanticModel>{};
  auto old = load_model(a.keep.empty() ? a.output : a.keep);
  if (!old) {
    return Error{old.error().message + "\nIts corrections cannot be kept: repair or move it"};
  }
  return std::optional<SemanticModel>{std::move(*old)};
}

Result<semantic::BuiltModel> build(const Arguments& a, std::string& map_source) {
  Progress progress("map model", "stages");
  cloud::ReadOptions reading = a.read;
  reading.work_per_point = kWorkPerPoint;
  reading.memory = static_cast<std::uint64_t>(1e9 * a.memory);
  auto scan = cloud::read_scan(a.cloud, reading);
  if (!scan) return scan.error();
  for (const std::string& note : scan->notes) print_note(note);
  map_source = a.cloud + ", " + std::to_string(scan->cloud.size()) + " points";
  cloud::PointCloud<Scanner>& from = scan->cloud;  // a registered cloud is in its first scan's frame
  cloud::PointCloud<Cloud> cloud{std::move(from.points), std::move(from.normals), std::move(from.colours),
                                 std::move(from.labels), std::move(from.scans),   std::move(from.viewpoints)};
  semantic::ModelOptions options = a.model;
  options.spacing = scan->spacing;
  options.unit_known = a.read.unit || fs::path(a.cloud).extension() == ".3d";  // which is in centimetres
  options.unit_advice = ": --unit ft or --unit in";
  options.up_advice = ": --flip, --axes y-up or y-down, or --no-flip where it is right as it is";
  if (a.flip || a.no_flip) options.up = Eigen::Vector3d(0, 0, a.flip ? -1 : 1);
  auto built = semantic::build_model(std::move(cloud), options,
                                     [&](const char*, int done) { progress.update(done + 1, 6); });
  progress.finish();
  if (!built) return Error{a.cloud + ": " + built.error().message};
  for (const std::string& note : built->notes) print_note(note);
  return built;
}

void keep(const SemanticModel& old, SemanticModel& model) {
  const semantic::KeptCorrections kept = semantic::keep_corrections(old, model);
  if (kept.locked + kept.deleted + kept.drawn == 0) return;
  print_note("kept " + std::to_string(kept.locked) + " locked, " + std::to_string(kept.deleted) +
             " deleted and " + std::to_string(kept.drawn) + " virtual entities of the old model");
}

/// Writes a temporary file beside it and renames it when complete.
Status write_file(const std::string& path, const std::function<Status(const fs::path&)>& write) {
  if (path.empty()) return {};
  const fs::path name = fs::path(path).filename();
  return write_beside(path, {name.string()}, [&](const fs::path& folder) { return write(folder / name); });
}

Result<std::string> write_slice(const Arguments& a, const semantic::BuiltModel& built) {
  if (a.slice.empty()) return std::string();
  semantic::SliceOptions options;
  options.height = a.slice_height;
  options.floor = built.floor + built.shift;
  auto map = semantic::slice(built.cloud, options);
  if (!map) return map.error();
  map->id = pose::grid_map_id(*map);
  const std::string name = fs::path(a.slice).filename().string();
  const Status status = write_beside(a.slice, {name + ".yaml", name + ".pgm"}, [&](const fs::path& folder) {
    return pose::save_ros_map(*map, (folder / name).string());
  });
  return status ? Result<std::string>(map->id) : status.error();
}

Status check_written(const std::string& yaml, const std::string& path) {
  const auto model = parse_model(yaml, path);
  if (!model) return Error{"internal error: the model fails its validation:\n" + model.error().message};
  const auto remarks = parse_remarks(yaml, path);
  if (!remarks) return Error{"internal error: the model fails its validation:\n" + remarks.error().message};
  return {};
}

/// Labels of objects follow those of entities.
constexpr std::uint8_t kFirstObjectLabel = 16;

Status write_labelled(const fs::path& path, semantic::BuiltModel& built) {
  for (std::size_t i = 0; i < built.object_of.size(); ++i) {
    if (built.object_of[i] == semantic::kNoObject) continue;
    const auto kind = static_cast<std::uint8_t>(built.objects[built.object_of[i]].kind);
    built.cloud.labels[i] = static_cast<std::uint8_t>(kFirstObjectLabel + kind);
  }
  return cloud::write_ply(path, built.cloud);
}

Status run(const Arguments& a) {
  const auto start = std::chrono::steady_clock::now();
  if (Status status = check_outputs(a); !status) return status;
  const auto old = old_model(a);
  if (!old) return old.error();
  std::string source;
  auto built = build(a, source);
  if (!built) return built.error();
  built->model.source = source;
  if (*old) keep(**old, built->model);
  const auto map_id = write_slice(a, *built);
  if (!map_id) return map_id.error();
  // Poses in the slice's map are also poses in this model.
  built->model.map_id = *map_id;
  if (map_id->empty() && *old) built->model.map_id = (*old)->map_id;
  const semantic::ModelQuality quality = semantic::quality_of(*built);
  const ModelRemarks remarks{built->objects, quality.doubts};
  const std::string yaml = to_yaml(built->model) + to_yaml(remarks);
  if (const Status valid = check_written(yaml, a.output); !valid) return valid;
  if (Status status = write_text(a.output, yaml, a.overwrite); !status) return status;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!a.summary.empty()) {
    if (Status status = write_text(a.summary, model_summary(*built, quality, seconds), a.overwrite); !status)
      return status;
  }
  if (!a.gltf.empty()) {
    if (Status status = write_text(a.gltf, to_gltf(built->model), a.overwrite); !status) return status;
  }
  if (Status status = write_file(a.labelled, [&](const fs::path& p) { return write_labelled(p, *built); });
      !status)
    return status;
  std::string note;
  const std::string name = fs::path(a.cloud).stem().string();
  const Status drawn = write_file(a.picture, [&](const fs::path& p) {
    return draw_model(built->model, name, ModelPicture::both, p, &note, remarks);
  });
  if (!drawn) return drawn;
  if (!note.empty()) print_note(note);
  std::fprintf(stderr, "%s: %zu entities, %zu objects, %zu relations from %zu points in %.1f s\n",
               a.output.c_str(), built->model.entities.size(), built->objects.size(),
               built->model.relations.size(), built->cloud.size(), seconds);
  std::fprintf(stderr, "%s: %s\n", a.output.c_str(), semantic::quality_line(quality).c_str());
  if (const std::string words = semantic::heights_text(built->heights); !words.empty())
    std::fprintf(stderr, "%s: %s\n", a.output.c_str(), words.c_str());
  return {};
}

void add_options(CLI::App& command, Arguments& a) {
  static const std::map<std::string, semantic::SegmentationMethod> methods = {
      {"images", semantic::SegmentationMethod::images}, {"normals", semantic::SegmentationMethod::normals}};
  command.add_option("CLOUD", a.cloud, "Registered cloud (.ply, .pcd, .las, .bt, .xyz, .3d)")->required();
  command.add_option("-o,--output", a.output, "Model to write (YAML; - is standard output)")->required();
  command.add_option("--keep", a.keep,
                     "Model whose corrections are kept (default: MODEL itself, if it exists)");
  command.add_option("--gltf", a.gltf, "The model for viewers (glTF 2.0)");
  command.add_option("--picture", a.picture, "Plan and 3D view (PNG)");
  command.add_option("--summary", a.summary, "Summary (JSON; - is standard output)");
  command.add_option("--stages", a.model.segmentation.stages,
                     "Folder for a picture of each stage and the net as a graph");
  command.add_option(
      "--labelled", a.labelled,
      "The levelled cloud with a label per point (PLY): of the building 0 to 10, of objects 16 and more");
  command.add_option("--slice", a.slice, "PREFIX of a 2D map at laser height (ROS map YAML and PGM)");
  command.add_option("--slice-height", a.slice_height, "Height of the slice above the floor, m")
      ->check(CLI::Range(0.02, 10.0))
      ->capture_default_str();
  command.add_flag("--floor-to-zero", a.model.floor_to_zero,
                   "Move the model so that its ground floor is z = 0");
  command.add_option("--unit", a.read.unit, "Unit of the file: m, cm, mm, ft, in (default: by format)")
      ->transform(one_of(kLengthUnits))
      ->type_name("TEXT");
  command.add_option("--axes", a.read.axes, "Axes of the file (default: by format)")
      ->transform(one_of(kFileAxes))
      ->type_name("TEXT");
  command
      .add_option(
          "--method", a.model.method,
          "How surfaces are found: images (default), or normals, the paper's second pipeline: slower, "
          "coarser")
      ->transform(one_of(methods))
      ->type_name("TEXT");
  CLI::Option* flip = command.add_flag("--flip", a.flip, "The cloud is upside down: rotate it");
  command.add_flag("--no-flip", a.no_flip, "The cloud is upright: skip the check")->excludes(flip);
  command.add_option("--memory", a.memory, "Memory limit, GB (default: available memory)")
      ->check(CLI::Range(0.001, 1e6));
  command.add_option("--threads", a.model.segmentation.threads, "Threads; 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_flag("--force", a.overwrite, "Overwrite existing files; corrections in MODEL are kept");
}

}  // namespace

void add_map_model(CLI::App& map, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = map.add_subcommand("model", kDescription);
  command->footer(kFooter);
  add_options(*command, *arguments);
  run_where_given(*command, arguments, exit, run);
}

}  // namespace parhelion::tools

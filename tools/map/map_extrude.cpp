// `parhelion map extrude`: a semantic model from a 2D grid map.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "fusion/semantic/grid/extrude.hpp"
#include "fusion/semantic/pictures/plan_picture.hpp"
#include "protocols/yaml/document.hpp"
#include "tools/map/map_commands.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kDescription =
    "Make a semantic model from a 2D grid map: walls as boxes, blocks, a floor";
constexpr const char* kFooter =
    "Example:\n  parhelion map extrude site.yaml -o model.yaml --height 2.5 --picture model.png\n\n"
    "MAP is the YAML of a ROS map (map_server), as `parhelion slam --save-map` writes it. Each occupied cell "
    "ends up inside\n"
    "a box: straight ones in walls, the rest in small boxes labelled unknown. Specks of a few cells that no "
    "robot "
    "can come\nnear are left out (--min-support 1 keeps them).";

struct Arguments {
  std::string map, output, picture;
  semantic::ExtrudeOptions options;
  bool overwrite = false;
};

Status draw(const Arguments& arguments, const semantic::PlanPicture& picture) {
  const std::filesystem::path path = arguments.picture;
  return write_beside(path, {path.filename().string()}, [&](const std::filesystem::path& folder) {
    return semantic::draw_plan(picture, (folder / path.filename()).string());
  });
}

Status run(const Arguments& arguments) {
  for (const std::string& path : {arguments.output, arguments.picture}) {
    if (const Status free = check_writable(path, arguments.overwrite); !free) return free;
  }
  if (!arguments.picture.empty() && std::filesystem::path(arguments.picture).extension() != ".png")
    return Error{arguments.picture + ": expected a name that ends in .png"};
  if (const Status readable = yaml::check_file(arguments.map); !readable) return readable;
  const auto map = pose::load_ros_map(arguments.map);
  if (!map) return map.error();
  const auto model = semantic::extrude(*map, arguments.options);
  if (!model) return Error{arguments.map + ": " + model.error().message};
  if (Status status = write_text(arguments.output, to_yaml(*model), arguments.overwrite); !status)
    return status;
  const auto figures = semantic::measure_extrusion(*map, *model, arguments.options);
  std::fprintf(
      stderr,
      "%s: %zu walls, %zu blocks; %zu of %zu occupied cells covered, %.1f %% of %.1f m2 of boxes over free "
      "cells\n",
      arguments.output.c_str(), figures.walls, figures.unknown, figures.covered_cells, figures.occupied_cells,
      figures.box_area > 0 ? 100 * figures.box_area_over_free / figures.box_area : 0, figures.box_area);
  if (arguments.picture.empty()) return {};
  semantic::PlanPicture picture;
  picture.title = "Walls from the grid map";
  picture.subtitle = arguments.map + ": " + std::to_string(figures.walls) + " walls, " +
                     std::to_string(figures.unknown) + " blocks";
  picture.map = &*map;
  picture.model = &*model;
  return draw(arguments, picture);
}

}  // namespace

void add_map_extrude(CLI::App& map, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = map.add_subcommand("extrude", kDescription);
  command->footer(kFooter);
  command->add_option("MAP", arguments->map, "Grid map (ROS map YAML)")->required();
  command->add_option("-o,--output", arguments->output, "Model to write (YAML; - is standard output)")
      ->required();
  command->add_option("--height", arguments->options.height, "Height of the walls, m")->capture_default_str();
  command->add_option("--min-wall", arguments->options.min_wall_length, "Shortest wall, m")
      ->capture_default_str();
  command
      ->add_option("--min-support", arguments->options.min_support,
                   "Minimum cells of a group that no robot can approach")
      ->capture_default_str();
  command->add_flag("--ceiling", arguments->options.ceiling, "Add a ceiling");
  command->add_option("--picture", arguments->picture, "Picture of map and model (PNG)");
  command->add_flag("--force", arguments->overwrite, "Overwrite MODEL and the picture");
  run_where_given(*command, arguments, exit, run);
}

}  // namespace parhelion::tools

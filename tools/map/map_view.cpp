// `parhelion map view`: pictures of a semantic model.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/map/map_commands.hpp"
#include "tools/map/model_pictures.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;

constexpr const char* kDescription =
    "Draw a semantic model: labelled plan with coordinates and names, and coloured 3D view";
constexpr const char* kFooter =
    "Examples:\n  parhelion map view room.yaml -o room.png\n  parhelion map view room.yaml -o plan.png "
    "--plan";

struct Arguments {
  std::string model, output;
  bool plan = false, solid = false, overwrite = false;
};

Status run(const Arguments& a) {
  if (const Status free = check_writable(a.output, a.overwrite); !free) return free;
  const fs::path path = a.output;
  if (path.extension() != ".png") return Error{a.output + ": expected a name that ends in .png"};
  const auto model = load_model(a.model);
  if (!model) return model.error();
  const auto remarks = load_remarks(a.model);
  if (!remarks) return remarks.error();
  const ModelPicture what = a.plan ? ModelPicture::plan : a.solid ? ModelPicture::solid : ModelPicture::both;
  std::string note;
  const std::string name = fs::path(a.model).stem().string();
  const Status status = write_beside(path, {path.filename().string()}, [&](const fs::path& folder) {
    return draw_model(*model, name, what, folder / path.filename(), &note, *remarks);
  });
  if (status && !note.empty()) std::fprintf(stderr, "parhelion map view: %s\n", note.c_str());
  return status;
}

}  // namespace

void add_map_view(CLI::App& map, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = map.add_subcommand("view", kDescription);
  command->footer(kFooter);
  command->add_option("MODEL", arguments->model, "Semantic model (YAML)")->required();
  command->add_option("-o,--output", arguments->output, "Picture to write (PNG)")->required();
  CLI::Option* plan = command->add_flag("--plan", arguments->plan, "The plan only");
  command->add_flag("--3d", arguments->solid, "The 3D view only")->excludes(plan);
  command->add_flag("--force", arguments->overwrite, "Overwrite PICTURE");
  run_where_given(*command, arguments, exit, run);
}

}  // namespace parhelion::tools

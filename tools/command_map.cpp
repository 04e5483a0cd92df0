#include "tools/map/map_commands.hpp"

namespace parhelion::tools {

void add_map(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("map", "Make and show models of a site");
  command->footer(
      "Examples:\n  parhelion map model room.ply -o room.yaml --picture room.png\n  parhelion map extrude "
      "site.yaml -o model.yaml --picture model.png");
  command->require_subcommand(1);
  add_map_register(*command, exit);
  add_map_model(*command, exit);
  add_map_texture(*command, exit);
  add_map_view(*command, exit);
  add_map_extrude(*command, exit);
}

}  // namespace parhelion::tools

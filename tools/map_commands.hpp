// The subcommands of `parhelion map`, one file each.
#pragma once

#include "tools/command.hpp"

namespace parhelion::tools {

void add_map_extrude(CLI::App& map, Exit& exit);
void add_map_model(CLI::App& map, Exit& exit);
void add_map_register(CLI::App& map, Exit& exit);
void add_map_texture(CLI::App& map, Exit& exit);
void add_map_view(CLI::App& map, Exit& exit);

}  // namespace parhelion::tools

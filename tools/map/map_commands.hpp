// The subcommands of `parhelion map`, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "protocols/status.hpp"
#include "tools/command.hpp"

namespace parhelion::tools {

void add_map_extrude(CLI::App& map, Exit& exit);
void add_map_model(CLI::App& map, Exit& exit);
void add_map_register(CLI::App& map, Exit& exit);
void add_map_texture(CLI::App& map, Exit& exit);
void add_map_view(CLI::App& map, Exit& exit);

/// Calls `run`, which returns a Status, with the arguments where the subcommand is given; prints its error.
template <class Arguments, class Run>
void run_where_given(CLI::App& command, std::shared_ptr<Arguments> arguments, Exit& exit, Run run) {
  command.callback([name = command.get_name(), arguments = std::move(arguments), &exit, run] {
    const Status status = run(*arguments);
    if (!status) std::fprintf(stderr, "parhelion map %s: %s\n", name.c_str(), status.error().message.c_str());
    exit = status ? Exit::done : Exit::failed;
  });
}

}  // namespace parhelion::tools

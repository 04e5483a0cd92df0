// Shell completion, generated from the same table as --help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tools/command.hpp"

namespace parhelion::tools {

/// A bash script that completes the subcommands and options of `app`, the values of options with a fixed set
/// of them, and file names elsewhere.
std::string bash_completion(const CLI::App& app);

/// `parhelion completion`.
void add_completion(CLI::App& app, Exit& exit);

}  // namespace parhelion::tools

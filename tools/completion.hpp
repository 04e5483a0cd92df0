// Shell completion, made of the same table as --help.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "tools/command.hpp"

namespace parhelion::tools {

/// A script for bash that completes the subcommands and options of `app`, the words of options that take one
/// of a few, and file names elsewhere.
std::string bash_completion(const CLI::App& app);

/// `parhelion completion`.
void add_completion(CLI::App& app, Exit& exit);

}  // namespace parhelion::tools

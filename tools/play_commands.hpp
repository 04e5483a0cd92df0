// `parhelion play`.
#pragma once

#include <CLI/CLI.hpp>

#include "tools/command.hpp"

namespace parhelion::tools {

void add_play(CLI::App& app, Exit& exit);

}  // namespace parhelion::tools

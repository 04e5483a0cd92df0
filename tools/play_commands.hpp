// `parhelion play`.
#pragma once

#include <CLI/CLI.hpp>

#include "tools/command.hpp"

namespace parhelion {

void add_play(CLI::App& app, Exit& exit);

}  // namespace parhelion

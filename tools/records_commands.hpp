// The subcommands of trainees' records and of many sessions.
#pragma once

#include "tools/command.hpp"

namespace parhelion {

void add_records(CLI::App& app, Exit& exit);
void add_batch(CLI::App& app, Exit& exit);

}  // namespace parhelion

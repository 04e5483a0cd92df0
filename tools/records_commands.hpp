// The subcommands of trainees' records and of many sessions.
#pragma once

#include "tools/command.hpp"

namespace parhelion::tools {

void add_records(CLI::App& app, Exit& exit);
/// A subcommand of `records`.
void add_ranking(CLI::App& records, Exit& exit);
void add_batch(CLI::App& app, Exit& exit);

}  // namespace parhelion::tools

// Runs scripts that are due: their actions are internal commands, answered by events only on failure.
#pragma once

#include "server/tick/instructor_path.hpp"
#include "server/tick/scripts.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Dependencies of scripts.
struct ScriptPath {
  Scripts& scripts;
  AgentPath agents;
};

/// At each step.
void run_scripts(const TickContext& context, const ScriptPath& path);

}  // namespace parhelion::tick

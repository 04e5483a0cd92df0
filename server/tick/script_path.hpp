// Scripts that are due: their actions are commands that nobody sent, answered by events only where they fail.
#pragma once

#include "server/tick/instructor_path.hpp"
#include "server/tick/scripts.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// What scripts work on.
struct ScriptPath {
  Scripts& scripts;
  AgentPath agents;
};

/// At each step.
void run_scripts(const TickContext& context, const ScriptPath& path);

}  // namespace parhelion::tick

// ^C and SIGTERM end a command at its next safe point; another one, half a second later or more, ends it at
// once.
#pragma once

namespace parhelion::tools {

/// Call once, before threads are started.
void catch_stop_signals();
bool stop_asked();

}  // namespace parhelion::tools

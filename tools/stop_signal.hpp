// ^C and SIGTERM end a command at its next safe place; a second one ends it at once.
#pragma once

namespace parhelion {

/// Call once, before threads are started.
void catch_stop_signals();
bool stop_asked();

}  // namespace parhelion

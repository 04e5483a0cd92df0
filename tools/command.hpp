// A subcommand of `parhelion`: one file each, listed in main.cpp.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace parhelion::tools {

/// Exit codes of the program.
enum class Exit { done = 0, failed = 1, usage = 2 };

/// Adds a subcommand to `app`; its callback stores the exit code in `exit`.
using AddCommand = void (*)(CLI::App& app, Exit& exit);

void add_import(CLI::App& app, Exit& exit);
void add_slam(CLI::App& app, Exit& exit);
void add_calibrate(CLI::App& app, Exit& exit);
void add_map(CLI::App& app, Exit& exit);
void add_serve(CLI::App& app, Exit& exit);
void add_replay(CLI::App& app, Exit& exit);
void add_grade(CLI::App& app, Exit& exit);
void add_report(CLI::App& app, Exit& exit);
void add_demo(CLI::App& app, Exit& exit);
void add_inject(CLI::App& app, Exit& exit);
void add_drive(CLI::App& app, Exit& exit);
void add_joystick(CLI::App& app, Exit& exit);
void add_topic(CLI::App& app, Exit& exit);
void add_export(CLI::App& app, Exit& exit);
void add_validate(CLI::App& app, Exit& exit);
void add_doctor(CLI::App& app, Exit& exit);
void add_key(CLI::App& app, Exit& exit);
void add_relay(CLI::App& app, Exit& exit);
void add_robot(CLI::App& app, Exit& exit);

}  // namespace parhelion::tools

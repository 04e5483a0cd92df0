// The `parhelion` command: subcommands, exit codes 0 done, 1 failed, 2 usage.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string_view>

#include "tools/command.hpp"
#include "tools/command_line.hpp"
#include "tools/completion.hpp"
#include "tools/play_commands.hpp"
#include "tools/records_commands.hpp"

int main(int argc, char** argv) try {
  using namespace parhelion::tools;
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of its writer, as on a full disk
  CLI::App app{
      "Parhelion: virtual robots beside a real one, in its laser scans and its camera video.\n"
      "Start here: parhelion demo"};
  app.name("parhelion");
  app.require_subcommand(1);
  app.set_version_flag("--version", PARHELION_VERSION);
  Exit exit = Exit::done;
  const AddCommand commands[] = {PARHELION_COMMANDS};
  for (const AddCommand add : commands) add(app, exit);
  app.set_help_all_flag("--help-all", "Print the help of all commands and exit");
  // `parhelion --parse-only COMMAND...`: the documents' test checks command lines with it.
  const int parse_only = argc > 1 && std::string_view(argv[1]) == "--parse-only" ? 1 : 0;
  if (parse_only != 0) app.parse_complete_callback([] { throw CLI::Success(); });  // before the command runs
  try {
    app.parse(typed_arguments(argc - parse_only, argv + parse_only));
  } catch (const CLI::CallForAllHelp&) {
    std::fputs(help_of_all(app).c_str(), stdout);
  } catch (const CLI::Success& request) {
    const bool asks_of_nothing = app.get_subcommands().empty() && !app.remaining().empty();
    if (!asks_of_nothing) return app.exit(request);
    std::fputs(explain(app, request).c_str(), stderr);
    return static_cast<int>(Exit::usage);
  } catch (const CLI::ParseError& error) {
    std::fputs(explain(app, error).c_str(), stderr);
    return static_cast<int>(Exit::usage);
  }
  return static_cast<int>(exit);
} catch (const std::exception& error) {
  std::fprintf(stderr, "parhelion: %s\n", error.what());
  return 1;
}

// What is wrong with a command line, in words that say what to type instead.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace parhelion::tools {

/// What was typed, for CLI::App::parse (the last word first). `help WORDS` is `WORDS --help`.
std::vector<std::string> typed_words(int argc, const char* const* argv);

/// "parhelion: unknown subcommand 'relay', did you mean 'replay'?" and the like, one line and a pointer to
/// --help. `app` is the program's, after the parse that threw `error`.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

}  // namespace parhelion::tools

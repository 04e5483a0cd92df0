// The command line: its words, the help of all commands, and error messages with suggestions.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace parhelion::tools {

/// Arguments for CLI::App::parse (last word first). `help WORDS` becomes `WORDS --help`, `help --all` becomes
/// `--help-all`.
std::vector<std::string> typed_arguments(int argc, const char* const* argv);

/// "parhelion: unknown subcommand 'relay', did you mean 'replay'?" and the like: one line and a pointer to
/// --help. `app` is the program's, after the parse that threw `error`.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

/// The help of `app` and of all its subcommands, each after a line "== parhelion map model ==".
std::string help_of_all(const CLI::App& app);

/// For CLI::Option::transform: restricts the value to these words, which the help shows and the shell
/// completes.
template <class Enumeration>
CLI::Validator one_of(const std::map<std::string, Enumeration>& values) {
  std::string words;
  for (const auto& [word, value] : values) words += (words.empty() ? "" : ",") + word;
  const auto replace = [values, words](std::string& text) -> std::string {
    const auto found = values.find(text);
    if (found == values.end()) return "expected one of " + words + ", found '" + text + "'";
    text = std::to_string(static_cast<int>(found->second));
    return {};
  };
  return CLI::Validator(replace, "{" + words + "}");
}

}  // namespace parhelion::tools

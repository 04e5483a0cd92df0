// The command line: what was typed, the help of all commands, what is wrong and what to type instead.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace parhelion::tools {

/// What was typed, for CLI::App::parse (the last word first). `help WORDS` is `WORDS --help`, `help --all` is
/// `--help-all`.
std::vector<std::string> typed_words(int argc, const char* const* argv);

/// "parhelion: unknown subcommand 'relay', did you mean 'replay'?" and the like, one line and a pointer to
/// --help. `app` is the program's, after the parse that threw `error`.
std::string explain(const CLI::App& app, const CLI::ParseError& error);

/// The help of `app` and of each command below it, each after a line "== parhelion map model ==".
std::string help_of_all(const CLI::App& app);

/// For CLI::Option::transform: one of these words, shown in help and completed by the shell.
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

#include "tools/command_line.hpp"

#include <algorithm>

#include "protocols/nearest_name.hpp"
#include "protocols/yaml/schema.hpp"

namespace parhelion::tools {
namespace {

std::vector<const CLI::App*> subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> subcommand_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* each : subcommands(app)) names.push_back(each->get_name());
  return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// The first word that no command accepts.
std::string unknown_argument_text(const CLI::App& command, const std::vector<std::string>& rest) {
  const auto option =
      std::find_if(rest.begin(), rest.end(), [](const std::string& word) { return word.starts_with('-'); });
  if (option != rest.end()) {
    const std::string name = option->substr(0, option->find('='));
    return "unknown option '" + name + "'" + suggestion(name, option_names(command));
  }
  const auto names = subcommand_names(command);
  if (names.empty()) return "'" + rest.front() + "' is an unexpected argument";
  const std::string hint = suggestion(rest.front(), names);
  return "unknown subcommand '" + rest.front() + "'" + (hint.empty() ? "; there are " + joined(names) : hint);
}

/// `parents`: the words before the command's own name.
void add_help(const CLI::App& command, const std::string& parents, std::string& text) {
  const std::string words = parents + (parents.empty() ? "" : " ") + command.get_name();
  text += "== " + words + " ==\n" + command.help(parents) + "\n";
  for (const CLI::App* each : subcommands(command)) {
    const bool is_group_of_options = each->get_name().empty();
    if (!is_group_of_options) add_help(*each, words, text);
  }
}

}  // namespace

std::vector<std::string> typed_arguments(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (!words.empty() && words.front() == "help") {
    words.erase(words.begin());
    if (words == std::vector<std::string>{"--all"}) return {"--help-all"};
    words.emplace_back("--help");
  }
  std::reverse(words.begin(), words.end());
  return words;
}

std::string explain(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* command = &app;
  std::string name = app.get_name();
  while (!command->get_subcommands().empty()) {
    command = command->get_subcommands().back();
    name += " " + command->get_name();
  }
  std::string what = error.what();
  const std::vector<std::string> rest = command->remaining();
  const bool wants_subcommand = command->get_require_subcommand_min() > 0;
  const bool is_unknown_argument =
      !rest.empty() && (wants_subcommand || dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr);
  if (is_unknown_argument) {
    what = unknown_argument_text(*command, rest);
  } else if (wants_subcommand) {
    what = "which of " + joined(subcommand_names(*command)) + "?";
  }
  return name + ": " + what + "\nSee " + name + " --help.\n";
}

std::string help_of_all(const CLI::App& app) {
  std::string text;
  add_help(app, "", text);
  return text;
}

}  // namespace parhelion::tools

#include "tools/completion.hpp"

#include <vector>

namespace parhelion::tools {
namespace {

std::string quoted(const std::string& text) { return '\'' + text + '\''; }

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return names;
}

/// Parses CLI11's "TEXT:{auto,on,off}" or "TEXT:{mm->0,cm->1}"; empty: any word.
std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  std::vector<std::string> choices = CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
  for (std::string& choice : choices) choice = choice.substr(0, choice.find("->"));
  return choices;
}

/// The cases of the script for all commands, each selected by the words before the completed one.
struct Cases {
  std::string commands;  ///< words that select a subcommand
  std::string values;    ///< after an option that takes one
  std::string offers;    ///< subcommands or choices, and options
};

/// Possible words after one command.
struct Offers {
  std::vector<std::string> words, options;
  bool takes_values = false;
};

void add_options(const CLI::App& command, const std::string& path, Offers& offers, Cases& cases) {
  for (const CLI::Option* option : command.get_options()) {
    const std::vector<std::string> choices = choices_of(*option);
    if (option->get_positional()) {
      offers.takes_values = true;
      offers.words.insert(offers.words.end(), choices.begin(), choices.end());
    }
    for (const std::string& name : names_of(*option)) {
      offers.options.push_back(name);
      if (option->get_items_expected_max() > 0)
        cases.values += "    " + quoted(path + ' ' + name) + ") words=" + quoted(joined(choices)) + " ;;\n";
    }
  }
}

void add_cases(const CLI::App& command, const std::string& path, Cases& cases) {
  Offers offers;
  add_options(command, path, offers, cases);
  for (const CLI::App* each : command.get_subcommands([](const CLI::App*) { return true; })) {
    if (each->get_name().empty()) {  // a group of the command's own options
      add_options(*each, path, offers, cases);
      continue;
    }
    const std::string below = path + ' ' + each->get_name();
    offers.words.push_back(each->get_name());
    cases.commands += (cases.commands.empty() ? "" : " | ") + quoted(below);
    add_cases(*each, below, cases);
  }
  if (offers.words.empty() && !offers.takes_values) offers.words = offers.options;
  cases.offers += "      " + quoted(path) + ") words=" + quoted(joined(offers.words)) +
                  " options=" + quoted(joined(offers.options)) + " ;;\n";
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  Cases cases;
  const std::string name = app.get_name();
  add_cases(app, name, cases);
  // Without an offer, bash completes file names.
  return "# bash completion, printed by: " + name + " completion\n_" + name + R"(() {
  local path=')" +
         name + R"(' current=${COMP_WORDS[COMP_CWORD]} words options i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case "$path ${COMP_WORDS[i]}" in
      )" +
         cases.commands +
         R"() path="$path ${COMP_WORDS[i]}" ;;
    esac
  done
  case "$path ${COMP_WORDS[COMP_CWORD - 1]}" in
)" + cases.values +
         R"(    *) case "$path" in
)" + cases.offers +
         R"(    esac ;;
  esac
  [[ $current == -* ]] && words=$options
  local IFS=$' \n'
  COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _)" +
         name + ' ' + name + '\n';
}

}  // namespace parhelion::tools

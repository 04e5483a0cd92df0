// The signature of a function in the tick should list the state that it uses, so few functions take the whole
// tick::State. Counts them, by name and parameters, and prints the list.
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace parhelion {
namespace {

namespace fs = std::filesystem;
using ServerSources = std::map<std::string, std::string>;  // path from the root -> text

/// Dispatch of inputs and steps, and construction of the state.
const std::set<std::string> kWiring = {"server/tick/tick.hpp", "server/tick/tick.cpp",
                                       "server/tick/physics_path.hpp", "server/tick/physics_path.cpp",
                                       "server/tick/state.cpp"};
constexpr std::size_t kLimit = 13;  // a tenth of the 132 before the state was split

std::string without_comments(const std::string& text) {
  static const std::regex comment("//[^\n]*");
  return std::regex_replace(text, comment, "");
}

/// The opening parenthesis around `at`; npos: none in this statement.
std::size_t opening_of(const std::string& text, std::size_t at) {
  int depth = 0;
  for (std::size_t i = at; i-- > 0;) {
    if (text[i] == ')') ++depth;
    if (text[i] == '(' && depth-- == 0) return i;
    if (text[i] == ';' || text[i] == '{' || text[i] == '}') return std::string::npos;
  }
  return std::string::npos;
}

/// The parameters from `open` on, without default values, in one line.
std::string parameters(const std::string& text, std::size_t open) {
  std::string made;
  int depth = 0;
  bool in_default = false;
  for (std::size_t i = open; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '(') ++depth;
    if (c == ')') --depth;
    if (depth == 1 && c == '=') in_default = true;
    if ((depth == 1 && c == ',') || depth == 0) in_default = false;
    if (!in_default && (!std::isspace(static_cast<unsigned char>(c)) || made.back() != ' '))
      made += std::isspace(static_cast<unsigned char>(c)) ? ' ' : c;
    if (depth == 0) break;
  }
  return std::regex_replace(made, std::regex(" (?=[,)])"), "");
}

/// "name(parameters)" without the class; empty name for a lambda.
std::string signature(const std::string& text, std::size_t open) {
  std::size_t begin = open;
  while (begin > 0 && (std::isalnum(static_cast<unsigned char>(text[begin - 1])) || text[begin - 1] == '_'))
    --begin;
  return text.substr(begin, open - begin) + parameters(text, open);
}

/// Signature -> places. In server/tick any State is meant, elsewhere tick::State.
std::map<std::string, std::set<std::string>> functions_of_state(const ServerSources& sources) {
  static const std::regex in_tick("(^|[^\\w:])State&"), elsewhere("\\btick::State&");
  std::map<std::string, std::set<std::string>> found;
  for (const auto& [path, commented] : sources) {
    const std::string text = without_comments(commented);
    const std::regex& wanted = path.starts_with("server/tick/") ? in_tick : elsewhere;
    for (std::sregex_iterator match(text.begin(), text.end(), wanted), end; match != end; ++match) {
      const std::size_t open = opening_of(text, static_cast<std::size_t>(match->position()) + 1);
      if (open != std::string::npos) found[signature(text, open)].insert(path);
    }
  }
  return found;
}

ServerSources read_server() {
  ServerSources sources;
  const fs::path root = PARHELION_SOURCE_DIR;
  for (const char* folder : {"server", "tools"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension();
      if (!entry.is_regular_file() || (extension != ".cpp" && extension != ".hpp")) continue;
      std::ifstream in(entry.path());
      std::ostringstream text;
      text << in.rdbuf();
      sources[fs::relative(entry.path(), root).generic_string()] = text.str();
    }
  }
  return sources;
}

TEST(StateParameters, FewFunctionsTakeTheWholeState) {
  const ServerSources sources = read_server();
  EXPECT_GT(sources.size(), 100U) << "the sources were not found in " << PARHELION_SOURCE_DIR;
  const auto found = functions_of_state(sources);
  std::cout << found.size() << " functions take the whole tick::State&:\n";
  for (const auto& [function, paths] : found) {
    std::cout << "  " << *paths.begin() << ": " << function << "\n";
    for (const std::string& path : paths)
      EXPECT_TRUE(kWiring.contains(path)) << path << ": give " << function << " the part that it works on";
  }
  EXPECT_GT(found.size(), 0U) << "tick() takes it";
  EXPECT_LE(found.size(), kLimit);
}

TEST(StateParameters, AreFound) {
  const auto found = functions_of_state(
      {{"server/tick/a.hpp",
        "/// Of State& it takes all.\nvoid first(const State& state, int n = of(2));\nvoid other(PoseState& "
        "state);"},
       {"server/tick/a.cpp",
        "void first(const State& state,\n           int n) {\n  State& whole = state;\n}\n"},
       {"server/runtime/a.hpp",
        "std::optional<View> take(const tick::State& state);\nvoid sim(Other::State&);"},
       {"server/simulation/a.cpp", "void step(State& state);"}});
  std::set<std::string> names;
  for (const auto& [function, paths] : found) names.insert(function);
  EXPECT_EQ(names,
            (std::set<std::string>{"first(const State& state, int n)", "take(const tick::State& state)"}));
}

}  // namespace
}  // namespace parhelion

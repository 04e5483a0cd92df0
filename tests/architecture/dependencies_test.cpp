// Checks the dependency rules: reads every #include of the repository and fails on one that the table of
// modules (modules.txt) or of the folders inside a module (layers.txt) does not allow, on a third-party
// header outside the module that owns it, and on threads, clocks and files in the tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace parhelion {
namespace {

namespace fs = std::filesystem;
using Sources = std::map<std::string, std::string>;            // path from the root -> text
using Modules = std::map<std::string, std::set<std::string>>;  // module -> all modules that it may include,
                                                               // itself included

/// Permissions for third parties: prefixes of their headers -> prefixes of paths.
const std::vector<std::pair<std::string, std::vector<std::string>>> kOwners = {
    {"Eigen/", {""}},
    {"lcm/", {"protocols/bus/"}},
    {"yaml-cpp/", {"protocols/yaml/", "fusion/pose/maps/grid_map.cpp"}},
    {"valijson/", {"protocols/yaml/", "server/station/client_messages.cpp"}},
    {"nlohmann/", {"protocols/yaml/", "server/", "tools/"}},
    {"assimp/", {"protocols/"}},
    {"openssl/", {"protocols/sha256.cpp", "server/station/"}},
    {"sodium.h", {"protocols/authentication/"}},
    {"mrpt/", {"fusion/pose/mrpt/", "tools/import/"}},
    {"embree3/", {"fusion/scan/"}},
    {"tbb/", {"fusion/"}},
    {"oneapi/", {"fusion/"}},
    {"immintrin.h", {"fusion/"}},
    {"opencv2/", {"fusion/semantic/pictures/", "render/", "tools/"}},
    {"EGL/", {"render/"}},
    {"GLES", {"render/"}},
    {"turbojpeg.h", {"render/"}},
    {"wels/", {"render/h264_encoder.cpp"}},
    {"png.h", {"render/", "tools/import/"}},
    {"zlib.h", {"render/", "server/station/", "tools/import/", "tools/export/"}},
    {"bzlib.h", {"tools/import/"}},
    {"lz4", {"tools/import/", "tools/export/"}},
    {"zstd.h", {"tools/export/", "tools/import/"}},
    {"argon2.h", {"server/station/http/"}},
    {"bt", {"server/simulation/physics/"}},
    {"Bullet", {"server/simulation/physics/"}},
    {"LinearMath/", {"server/simulation/physics/"}},
    {"tinyxml2.h", {"server/simulation/robots/"}},
    {"assimp/", {"protocols/mesh_file.cpp"}},
    {"sqlite3.h", {"server/training/", "tools/import/"}},
    {"boost/", {"server/station/"}},
    {"SDL2/", {"server/station/"}},
    {"CLI/", {"tools/"}},
    {"ros", {"tools/import/"}},
};

bool is_system_header(const std::string& name) {
  static const std::regex standard("[a-z_0-9]+");
  static const std::regex posix(
      "(sys|arpa|net|netinet|linux)/"
      ".*\\.h|(unistd|fcntl|poll|sched|dlfcn|signal|pthread|termios|spawn|getopt|glob|ifaddrs|pwd)\\.h");
  return std::regex_match(name, standard) || std::regex_match(name, posix);
}

bool begins_with_any(const std::string& text, const std::vector<std::string>& beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(),
                     [&](const auto& b) { return text.starts_with(b); });
}

struct Include {
  int line;
  std::string name;
  bool quoted;
};

std::vector<Include> includes_of(const std::string& text) {
  static const std::regex directive(R"re(^\s*#\s*include\s*(?:"([^"]+)"|<([^>]+)>))re");
  std::vector<Include> includes;
  std::istringstream lines(text);
  std::smatch match;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::size_t first = line.find_first_not_of(" \t");
    if (first == std::string::npos || line[first] != '#') continue;  // the expression alone takes a minute
    if (std::regex_search(line, match, directive))
      includes.push_back({number, match[1].matched ? match[1] : match[2], match[1].matched});
  }
  return includes;
}

/// Parses modules.txt; permissions are transitive.
Modules read_modules(std::istream& in) {
  Modules modules;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string module, arrow, used;
    if (!(words >> module)) continue;
    std::set<std::string>& allowed = modules[module];
    allowed.insert(module);
    for (words >> arrow; words >> used;) {
      const auto lower = modules.find(used);
      if (lower == modules.end()) {
        ADD_FAILURE() << "modules.txt: " << module << " uses " << used
                      << ", which is not above it in the file";
        continue;
      }
      allowed.insert(lower->second.begin(), lower->second.end());
    }
  }
  return modules;
}

const Modules& modules() {
  static const Modules read = [] {
    std::ifstream in(fs::path(PARHELION_SOURCE_DIR) / "tests/architecture/modules.txt");
    return read_modules(in);
  }();
  return read;
}

/// "fusion/pose" for fusion/pose/slam.cpp; "tests" and "examples" for files in them; empty: no module.
std::string module_of(const std::string& path) {
  for (const auto& [module, allowed] : modules()) {
    if (path.starts_with(module + "/")) return module;
  }
  for (const char* other : {"tests", "examples"}) {
    if (path.starts_with(std::string(other) + "/")) return other;
  }
  return "";
}

/// The reason why `path` may not have this include, or nothing.
std::string objection(const Sources& sources, const std::string& path, const Include& include) {
  const std::string module = module_of(path);
  if (module.empty()) return "lies in no module of tests/architecture/modules.txt";
  if (!include.quoted) {
    if (module == "tests" || is_system_header(include.name)) return "";
    for (const auto& [beginning, allowed] : kOwners) {
      if (!include.name.starts_with(beginning)) continue;
      return begins_with_any(path, allowed) ? "" : "<" + include.name + "> belongs to another module";
    }
    return "<" + include.name + "> has no owner; name one in tests/architecture/dependencies_test.cpp";
  }
  // Generated by lcm-gen.
  if (include.name.starts_with("parhelion/")) {
    return module == "tests" || path.starts_with("protocols/codec") ? "" : "only the codec names wire types";
  }
  // Tests may include a file in the same folder without its path.
  if (module == "tests" && sources.contains(path.substr(0, path.rfind('/') + 1) + include.name)) return "";
  if (!sources.contains(include.name)) return '"' + include.name + "\" is no file from the root";
  const std::string target = module_of(include.name);
  if (module == "tests") return "";
  return modules().at(module).contains(target) ? "" : module + " must not depend on " + target;
}

/// The transitive includes of `path` within the repository, itself first.
std::vector<std::string> closure(const Sources& sources, const std::string& path) {
  std::vector<std::string> found = {path};
  std::set<std::string> seen = {path};
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (const Include& include : includes_of(sources.at(found[i]))) {
      if (include.quoted && sources.contains(include.name) && seen.insert(include.name).second)
        found.push_back(include.name);
    }
  }
  return found;
}

/// Files of other modules that include the header, directly or indirectly.
std::set<std::string> foreign_readers(const Sources& sources, const std::string& header) {
  std::set<std::string> seen = {header}, readers;
  for (std::deque<std::string> open = {header}; !open.empty(); open.pop_front()) {
    for (const auto& [path, text] : sources) {
      if (seen.contains(path) || path.starts_with("tests/")) continue;
      for (const Include& include : includes_of(text)) {
        if (!include.quoted || include.name != open.front()) continue;
        seen.insert(path);
        open.push_back(path);
        if (module_of(path) != module_of(header)) readers.insert(path);
        break;
      }
    }
  }
  return readers;
}

std::vector<std::string> violations(const Sources& sources) {
  std::vector<std::string> found;
  for (const auto& [path, text] : sources) {
    if (path.starts_with("examples/")) continue;  // programs of users, which know the LCM types alone
    bool third_party = false;
    for (const Include& include : includes_of(text)) {
      const std::string why = objection(sources, path, include);
      if (!why.empty()) found.push_back(path + ":" + std::to_string(include.line) + ": " + why);
      third_party = third_party || (!include.quoted && !is_system_header(include.name) &&
                                    !include.name.starts_with("Eigen/"));
    }
    if (!third_party || !path.ends_with(".hpp") || path.starts_with("tests/")) continue;
    for (const std::string& reader : foreign_readers(sources, path)) {
      found.push_back(path + ": names a third party, and another module sees it: " + reader);
    }
  }
  return found;
}

/// Parses layers.txt: module -> its folders, from the bottom up.
std::map<std::string, std::vector<std::string>> read_layers() {
  std::ifstream in(fs::path(PARHELION_SOURCE_DIR) / "tests/architecture/layers.txt");
  std::map<std::string, std::vector<std::string>> layers;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string module, folder;
    if (!std::getline(words, module, ':')) continue;
    while (words >> folder) layers[module].push_back(folder);
  }
  return layers;
}

/// Files in a folder of layers.txt that include a file of their module from a higher folder, or from one that
/// is not named there.
std::vector<std::string> upward_includes(const Sources& sources) {
  std::vector<std::string> found;
  for (const auto& [module, folders] : read_layers()) {
    const auto layer_of = [&](const std::string& path) {
      const auto in_it = [&](const auto& folder) { return path.starts_with(module + "/" + folder + "/"); };
      return std::find_if(folders.begin(), folders.end(), in_it);
    };
    for (const auto& [path, text] : sources) {
      const auto own = layer_of(path);
      if (own == folders.end()) continue;
      for (const Include& include : includes_of(text)) {
        if (!include.name.starts_with(module + "/") || layer_of(include.name) <= own) continue;
        found.push_back(path + ":" + std::to_string(include.line) + ": " + *own + " must not include " +
                        include.name);
      }
    }
  }
  return found;
}

/// Places where the tick's sources, or their includes within the repository, use threads, locks, clocks,
/// sockets or files.
std::vector<std::string> impurities(const Sources& sources) {
  static const std::set<std::string> forbidden = {
      "thread", "mutex",    "shared_mutex", "atomic",  "condition_variable", "future",   "semaphore",
      "latch",  "barrier",  "stop_token",   "fstream", "filesystem",         "unistd.h", "fcntl.h",
      "poll.h", "pthread.h"};
  static const std::regex clock("\\b(steady_clock|system_clock|high_resolution_clock)\\b");
  std::set<std::string> found;
  for (const auto& [path, text] : sources) {
    if (!path.starts_with("server/tick/")) continue;
    for (const std::string& reached : closure(sources, path)) {
      const std::string& content = sources.at(reached);
      for (const Include& include : includes_of(content)) {
        if (include.quoted) continue;
        if (forbidden.contains(include.name) || include.name.starts_with("sys/") ||
            include.name.starts_with("net") || include.name.starts_with("arpa/"))
          found.insert(path + " reaches <" + include.name + "> through " + reached);
      }
      if (content.find("_clock") != std::string::npos && std::regex_search(content, clock))
        found.insert(path + " reaches a clock through " + reached);
    }
  }
  return {found.begin(), found.end()};
}

Sources read_sources(const std::vector<std::string>& folders, const std::set<std::string>& extensions) {
  Sources sources;
  const fs::path root = PARHELION_SOURCE_DIR;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string path = fs::relative(entry.path(), root).generic_string();
      if (!entry.is_regular_file() || !extensions.contains(entry.path().extension())) continue;
      if (path.find("/dist/") != std::string::npos || path.find("/node_modules/") != std::string::npos)
        continue;
      std::ifstream in(entry.path());
      std::ostringstream text;
      text << in.rdbuf();
      sources[path] = text.str();
    }
  }
  return sources;
}

Sources read_cpp() {
  return read_sources({"protocols", "fusion", "render", "server", "tools", "tests", "examples"},
                      {".cpp", ".hpp", ".h"});
}

TEST(Dependencies, FollowTheDependencyTable) {
  const Sources sources = read_cpp();
  EXPECT_GT(sources.size(), 500U) << "the sources were not found in " << PARHELION_SOURCE_DIR;
  for (const std::string& violation : violations(sources)) ADD_FAILURE() << violation;
}

TEST(Dependencies, FollowTheLayersInsideAModule) {
  const Sources sources = read_cpp();
  for (const auto& [module, folders] : read_layers()) {
    for (const std::string& folder : folders)
      EXPECT_TRUE(fs::is_directory(fs::path(PARHELION_SOURCE_DIR) / module / folder))
          << module << " " << folder;
  }
  for (const std::string& include : upward_includes(sources)) ADD_FAILURE() << include;
}

TEST(Dependencies, AnIncludeFromAHigherLayerIsDetected) {
  const Sources sources = {
      {"fusion/pose/maps/a.hpp",
       "#include \"fusion/pose/matching/b.hpp\"\n#include \"fusion/pose/mapping/b.hpp\"\n"},
      {"fusion/pose/matching/a.hpp", "#include \"fusion/pose/slam.hpp\"\n#include \"protocols/a.hpp\"\n"},
      {"fusion/pose/slam.cpp", "#include \"fusion/pose/mapping/b.hpp\"\n"}};
  EXPECT_EQ(upward_includes(sources),
            (std::vector<std::string>{
                "fusion/pose/maps/a.hpp:2: maps must not include fusion/pose/mapping/b.hpp",
                "fusion/pose/matching/a.hpp:1: matching must not include fusion/pose/slam.hpp"}));
}

TEST(Dependencies, ArePrintedForEachModule) {
  std::map<std::string, std::set<std::string>> found;
  for (const auto& [path, text] : read_cpp()) {
    if (path.starts_with("tests/")) continue;
    for (const Include& include : includes_of(text)) {
      const std::string target = include.quoted ? module_of(include.name) : "";
      if (!target.empty() && target != module_of(path)) found[module_of(path)].insert(target);
    }
  }
  for (const auto& [module, allowed] : modules()) {
    std::string line = module + (found[module].empty() ? "" : " <-");
    for (const std::string& used : found[module]) line += " " + used;
    std::printf("%s\n", line.c_str());
    for (const std::string& used : found[module])
      EXPECT_TRUE(allowed.contains(used)) << module << " uses " << used;
  }
}

TEST(Modules, AreEachAFolderWithATargetAndAReadme) {
  for (const auto& [module, allowed] : modules()) {
    const fs::path folder = fs::path(PARHELION_SOURCE_DIR) / module;
    EXPECT_TRUE(fs::exists(folder / "README.md")) << module;
    std::ifstream in(folder / "CMakeLists.txt");
    const std::string cmake{std::istreambuf_iterator<char>(in), {}};
    EXPECT_NE(cmake.find("parhelion_library(parhelion_" + module.substr(module.rfind('/') + 1)),
              std::string::npos)
        << module;
  }
}

TEST(Modules, AreNoMoreThanAFifthOfTheCodeEach) {
  std::map<std::string, std::ptrdiff_t> lines;
  std::ptrdiff_t all = 0;
  for (const auto& [path, text] :
       read_sources({"protocols", "fusion", "render", "server", "tools"},
                    {".cpp", ".hpp", ".in", ".ts", ".svelte", ".js", ".mjs", ".css", ".html"})) {
    const auto count = std::count(text.begin(), text.end(), '\n');
    lines[module_of(path)] += count;
    all += count;
  }
  for (const auto& [module, count] : lines) {
    const double fraction = static_cast<double>(count) / static_cast<double>(all);
    std::printf("%-18s %6td lines, %4.1f %%\n", module.c_str(), count, 100 * fraction);
    EXPECT_LE(fraction, 0.22) << module << ": cut it in two";
  }
}

TEST(Tick, UsesNoThreadLockClockSocketOrFile) {
  const Sources sources = read_cpp();
  for (const std::string& impurity : impurities(sources)) ADD_FAILURE() << impurity;
}

TEST(Tick, IndirectUseOfAThreadIsDetected) {
  const Sources sources = {{"server/tick/a.cpp", "#include \"server/tick/a.hpp\"\n"},
                           {"server/tick/a.hpp", "#include \"protocols/b.hpp\"\n"},
                           {"protocols/b.hpp", "#include <mutex>\n"},
                           {"server/tick/c.cpp", "auto now = std::chrono::steady_clock::now();\n"},
                           {"server/runtime/d.cpp", "#include <thread>\n"}};
  EXPECT_EQ(impurities(sources),
            (std::vector<std::string>{"server/tick/a.cpp reaches <mutex> through protocols/b.hpp",
                                      "server/tick/a.hpp reaches <mutex> through protocols/b.hpp",
                                      "server/tick/c.cpp reaches a clock through server/tick/c.cpp"}));
}

TEST(Dependencies, UpwardDependenciesAreDetected) {
  const auto reported = [](const std::string& path, const std::string& line) {
    Sources sources = {{path, "\n" + line + "\n"}, {"tests/a.hpp", ""}};
    for (const auto& [module, allowed] : modules()) sources[module + "/a.hpp"] = "";
    return violations(sources);
  };
  EXPECT_EQ(reported("render/b.cpp", "#include \"fusion/scan/a.hpp\""),
            std::vector<std::string>{"render/b.cpp:2: render must not depend on fusion/scan"});
  std::size_t pairs = 0;
  for (const auto& [module, allowed] : modules()) {
    for (const auto& [target, unused] : modules()) {
      ++pairs;
      EXPECT_EQ(reported(module + "/b.cpp", "  #  include \"" + target + "/a.hpp\"").empty(),
                allowed.contains(target))
          << module << " of " << target;
    }
  }
  EXPECT_GE(pairs, 169U);
  EXPECT_EQ(reported("tools/b.cpp", "#include \"tests/a.hpp\"").size(), 1U);
  EXPECT_EQ(reported("tools/b.cpp", "#include \"a.hpp\"").size(), 1U) << "not from the root";
  EXPECT_EQ(reported("server/tick/b.cpp", "#include \"parhelion/pose_t.hpp\"").size(), 1U);
  EXPECT_EQ(reported("server/b.cpp", "#include <vector>").size(), 1U) << "in no module";
  EXPECT_TRUE(reported("tests/server/b.cpp", "#include \"tools/a.hpp\"").empty());
}

TEST(Dependencies, ThirdPartyLibrariesAreUsedOnlyByTheirOwners) {
  EXPECT_EQ(violations({{"render/a.cpp", "#include <mrpt/obs/CObservation.h>"}}).size(), 1U);
  EXPECT_EQ(violations({{"server/tick/a.cpp", "#include <lcm/lcm.h>"}}).size(), 1U);
  EXPECT_EQ(violations({{"server/tick/a.cpp", "#include <unheard_of/x.h>"}}).size(), 1U);
  EXPECT_TRUE(
      violations({{"server/tick/a.cpp", "#include <vector>\n#include <sys/stat.h>\n#include <Eigen/Core>"}})
          .empty());
  const Sources leaking = {
      {"server/simulation/physics/world.hpp", "#include <btBulletDynamicsCommon.h>"},
      {"server/simulation/physics/world.cpp", "#include \"server/simulation/physics/world.hpp\""},
      {"server/tick/tick.hpp", "#include \"server/simulation/physics/world.hpp\""},
      {"tools/serve.cpp", "#include \"server/tick/tick.hpp\""}};
  EXPECT_EQ(violations(leaking),
            (std::vector<std::string>{
                "server/simulation/physics/world.hpp: names a third party, and another module sees it: "
                "server/tick/tick.hpp",
                "server/simulation/physics/world.hpp: names a third party, and another module sees it: "
                "tools/serve.cpp"}));
}

}  // namespace
}  // namespace parhelion

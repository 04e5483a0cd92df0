// The rooms and their one-way doors: reads every #include of the repository and fails on one that should not
// be there. And types: two of one name in one namespace break each other silently when they are linked.
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
using Sources = std::map<std::string, std::string>;  // path from the root -> text

const std::map<std::string, std::set<std::string>> doors = {
    {"protocols", {"protocols"}},
    {"fusion", {"protocols", "fusion"}},
    {"render", {"protocols", "render"}},
    {"server", {"protocols", "fusion", "render", "server"}},
    {"tools", {"protocols", "fusion", "render", "server", "tools"}},
    {"tests", {"protocols", "fusion", "render", "server", "tools", "tests"}},
};

/// Who may name a third party: beginnings of its headers -> beginnings of paths.
const std::vector<std::pair<std::string, std::vector<std::string>>> owners = {
    {"Eigen/", {""}},
    {"lcm/", {"protocols/bus/"}},
    {"yaml-cpp/", {"protocols/yaml/", "fusion/pose/map_file.cpp"}},
    {"valijson/", {"protocols/yaml/", "server/station/page_messages.cpp"}},
    {"nlohmann/", {"protocols/yaml/", "server/", "tools/"}},
    {"assimp/", {"protocols/"}},
    {"openssl/", {"protocols/sha256.cpp", "server/station/"}},
    {"mrpt/", {"fusion/pose/", "tools/import/"}},
    {"embree3/", {"fusion/scan/"}},
    {"tbb/", {"fusion/"}},
    {"oneapi/", {"fusion/"}},
    {"immintrin.h", {"fusion/"}},
    {"opencv2/", {"fusion/semantic/", "render/", "tools/"}},
    {"EGL/", {"render/"}},
    {"GLES", {"render/"}},
    {"turbojpeg.h", {"render/"}},
    {"wels/", {"render/h264_encoder.cpp"}},
    {"png.h", {"render/", "tools/import/"}},
    {"zlib.h", {"render/", "server/station/", "tools/import/", "tools/export/"}},
    {"bzlib.h", {"tools/import/"}},
    {"lz4", {"tools/import/", "tools/export/"}},
    {"zstd.h", {"tools/export/"}},
    {"argon2.h", {"server/station/http/"}},
    {"bt", {"server/simulation/"}},
    {"Bullet", {"server/simulation/"}},
    {"LinearMath/", {"server/simulation/"}},
    {"urdf", {"server/simulation/"}},
    {"console_bridge/", {"server/simulation/"}},  // how urdfdom says its errors
    {"sanitizer/", {"server/simulation/"}},       // what urdfdom leaks
    {"sqlite3.h", {"server/training/"}},
    {"boost/", {"server/station/"}},
    {"SDL2/", {"server/station/"}},
    {"CLI/", {"tools/"}},
    {"spdlog/", {"tools/"}},
    {"ros", {"tools/import/"}},
};

bool is_system_header(const std::string& name) {
  static const std::regex standard("[a-z_0-9]+");
  static const std::regex posix(
      "(sys|arpa|net|netinet|linux)/"
      ".*\\.h|(unistd|fcntl|poll|sched|dlfcn|signal|pthread|termios|spawn|getopt|glob|ifaddrs)\\.h");
  return std::regex_match(name, standard) || std::regex_match(name, posix);
}

bool begins_with_any(const std::string& text, const std::vector<std::string>& beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(),
                     [&](const auto& b) { return text.starts_with(b); });
}

/// "fusion/pose" of fusion/pose/slam.cpp, "render" of render/scene.cpp: what owns a third party.
std::string owner_room(const std::string& path) {
  static const std::vector<std::string> inner = {"fusion/pose",     "fusion/scan",       "fusion/cloud",
                                                 "fusion/semantic", "server/simulation", "server/training",
                                                 "server/hmi"};
  for (const std::string& room : inner) {
    if (path.starts_with(room + "/")) return room;
  }
  return path.substr(0, path.find('/'));
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
    if (std::regex_search(line, match, directive))
      includes.push_back({number, match[1].matched ? match[1] : match[2], match[1].matched});
  }
  return includes;
}

/// Why `path` may not have this include, or nothing.
std::string objection(const Sources& sources, const std::string& path, const Include& include) {
  const std::string room = path.substr(0, path.find('/'));
  if (!include.quoted) {
    if (room == "tests" || is_system_header(include.name)) return "";
    for (const auto& [beginning, allowed] : owners) {
      if (!include.name.starts_with(beginning)) continue;
      return begins_with_any(path, allowed) ? "" : "<" + include.name + "> belongs to another room";
    }
    return "<" + include.name + "> has no owner; name one in tests/architecture/dependencies_test.cpp";
  }
  // What lcm-gen wrote.
  if (include.name.starts_with("parhelion/")) {
    return room == "tests" || path.starts_with("protocols/codec") ? ""
                                                                  : "wire types are named by the codec only";
  }
  // Tests may name a file that lies beside them without its path.
  if (room == "tests" && sources.contains(path.substr(0, path.rfind('/') + 1) + include.name)) return "";
  if (!sources.contains(include.name)) return '"' + include.name + "\" is no file from the root";
  const std::string target = include.name.substr(0, include.name.find('/'));
  return doors.at(room).contains(target) ? "" : room + " has no door to " + target;
}

/// Rooms other than the header's own that see it, directly or through other headers.
std::set<std::string> foreign_readers(const Sources& sources, const std::string& header) {
  std::set<std::string> seen = {header}, rooms;
  for (std::deque<std::string> open = {header}; !open.empty(); open.pop_front()) {
    for (const auto& [path, text] : sources) {
      if (seen.contains(path) || path.starts_with("tests/")) continue;
      for (const Include& include : includes_of(text)) {
        if (!include.quoted || include.name != open.front()) continue;
        seen.insert(path);
        open.push_back(path);
        if (owner_room(path) != owner_room(header)) rooms.insert(path);
        break;
      }
    }
  }
  return rooms;
}

std::vector<std::string> violations(const Sources& sources) {
  std::vector<std::string> found;
  for (const auto& [path, text] : sources) {
    bool third_party = false;
    for (const Include& include : includes_of(text)) {
      const std::string why = objection(sources, path, include);
      if (!why.empty()) found.push_back(path + ":" + std::to_string(include.line) + ": " + why);
      third_party = third_party || (!include.quoted && !is_system_header(include.name) &&
                                    !include.name.starts_with("Eigen/"));
    }
    if (!third_party || !path.ends_with(".hpp") || path.starts_with("tests/")) continue;
    for (const std::string& reader : foreign_readers(sources, path)) {
      found.push_back(path + ": names a third party, and another room sees it: " + reader);
    }
  }
  return found;
}

/// Types defined at the left margin outside of anonymous namespaces: "parhelion::Scan" -> where. Tests are
/// programs of their own and left out.
std::map<std::string, std::vector<std::string>> types_of(const Sources& sources) {
  static const std::regex space(R"re(^namespace ([\w:]*) ?\{)re");
  static const std::regex type(R"re(^(?:struct|class) (\w+(?:::\w+)*)[^;()]*(?:\{|$))re");
  std::map<std::string, std::vector<std::string>> found;
  for (const auto& [path, text] : sources) {
    if (path.starts_with("tests/")) continue;
    std::vector<std::string> open;
    std::istringstream lines(text);
    std::smatch match;
    for (std::string line; std::getline(lines, line);) {
      if (std::regex_search(line, match, space)) {
        open.push_back(match[1]);
      } else if (line.starts_with("}  // namespace")) {
        if (!open.empty()) open.pop_back();
      } else if (std::regex_search(line, match, type) && std::count(open.begin(), open.end(), "") == 0) {
        std::string name;
        for (const std::string& each : open) name += each + "::";
        found[name + match[1].str()].push_back(path);
      }
    }
  }
  return found;
}

Sources read_repository() {
  Sources sources;
  const fs::path root = PARHELION_SOURCE_DIR;
  for (const auto& [room, allowed] : doors) {
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      const std::string extension = entry.path().extension();
      if (!entry.is_regular_file() || (extension != ".cpp" && extension != ".hpp" && extension != ".h"))
        continue;
      std::ifstream in(entry.path());
      std::ostringstream text;
      text << in.rdbuf();
      sources[fs::relative(entry.path(), root).generic_string()] = text.str();
    }
  }
  return sources;
}

TEST(Doors, OfTheRepositoryAreOneWay) {
  const Sources sources = read_repository();
  EXPECT_GT(sources.size(), 50U) << "the sources were not found in " << PARHELION_SOURCE_DIR;
  for (const std::string& violation : violations(sources)) ADD_FAILURE() << violation;
}

TEST(Doors, AClosedOneIsFound) {
  const auto reported = [](const std::string& path, const std::string& line) {
    return violations({{path, "\n" + line + "\n"},
                       {"protocols/a.hpp", ""},
                       {"fusion/scan/a.hpp", ""},
                       {"render/a.hpp", ""},
                       {"server/a.hpp", ""},
                       {"tools/a.hpp", ""},
                       {"tests/a.hpp", ""}});
  };
  EXPECT_EQ(reported("render/b.cpp", "#include \"fusion/scan/a.hpp\""),
            std::vector<std::string>{"render/b.cpp:2: render has no door to fusion"});
  EXPECT_EQ(reported("fusion/scan/b.cpp", "  #  include \"render/a.hpp\"").size(), 1U);
  EXPECT_EQ(reported("protocols/b.cpp", "#include \"server/a.hpp\"").size(), 1U);
  EXPECT_EQ(reported("server/b.cpp", "#include \"tools/a.hpp\"").size(), 1U);
  EXPECT_EQ(reported("tools/b.cpp", "#include \"tests/a.hpp\"").size(), 1U);
  EXPECT_EQ(reported("tools/b.cpp", "#include \"a.hpp\"").size(), 1U) << "not from the root";
  EXPECT_EQ(reported("server/b.cpp", "#include \"parhelion/pose_t.hpp\"").size(), 1U);
  EXPECT_TRUE(reported("tests/server/b.cpp", "#include \"tools/a.hpp\"").empty());
  EXPECT_TRUE(reported("server/b.cpp", "#include \"fusion/scan/a.hpp\"").empty());
}

TEST(Doors, AThirdPartyStaysInTheRoomThatOwnsIt) {
  EXPECT_EQ(violations({{"render/a.cpp", "#include <mrpt/obs/CObservation.h>"}}).size(), 1U);
  EXPECT_EQ(violations({{"server/a.cpp", "#include <lcm/lcm.h>"}}).size(), 1U);
  EXPECT_EQ(violations({{"server/a.cpp", "#include <unheard_of/x.h>"}}).size(), 1U);
  EXPECT_TRUE(
      violations({{"server/a.cpp", "#include <vector>\n#include <sys/stat.h>\n#include <Eigen/Core>"}})
          .empty());
  const Sources leaking = {{"server/simulation/world.hpp", "#include <btBulletDynamicsCommon.h>"},
                           {"server/simulation/world.cpp", "#include \"server/simulation/world.hpp\""},
                           {"server/tick/tick.hpp", "#include \"server/simulation/world.hpp\""},
                           {"tools/serve.cpp", "#include \"server/tick/tick.hpp\""}};
  EXPECT_EQ(
      violations(leaking),
      (std::vector<std::string>{
          "server/simulation/world.hpp: names a third party, and another room sees it: server/tick/tick.hpp",
          "server/simulation/world.hpp: names a third party, and another room sees it: tools/serve.cpp"}));
}

TEST(Types, HaveOneDefinitionEach) {
  const auto types = types_of(read_repository());
  EXPECT_GT(types.size(), 200U);
  for (const auto& [name, paths] : types) {
    std::string places;
    for (const std::string& path : paths) places += " " + path;
    EXPECT_EQ(paths.size(), 1U) << name << " is defined in" << places;
  }
}

TEST(Types, OfOneNameInTwoFilesAreFound) {
  const auto types = types_of(
      {{"server/a.hpp", "namespace parhelion {\nstruct A {\n};\nclass B;\n}  // namespace parhelion\n"},
       {"server/b.cpp",
        "namespace parhelion {\nnamespace {\nstruct B {};\n}  // namespace\n"
        "class A : public C {\n};\n}  // namespace parhelion\n"},
       {"server/c.hpp",
        "namespace parhelion::wire {\nclass A final {};\n}  // namespace parhelion::wire\n"}});
  EXPECT_EQ(types.at("parhelion::A").size(), 2U);
  EXPECT_EQ(types.at("parhelion::wire::A").size(), 1U);
  EXPECT_FALSE(types.contains("parhelion::B")) << "declared only, or nobody else's";
}

}  // namespace
}  // namespace parhelion

// Test files of one program are compiled together in a clean build (tests/CMakeLists.txt), so none may define
// a name at namespace scope that another defines, even in an unnamed namespace. Functions with other numbers
// of parameters and equal aliases are no conflict.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/file_bytes.hpp"

namespace parhelion {
namespace {

namespace fs = std::filesystem;

/// What a line at the left edge defines, and what it must be equal to where it stands twice.
struct Definition {
  std::string name, text;
};

std::vector<Definition> definitions_in(const std::string& line) {
  static const std::regex type("^(?:struct|class|enum class) (\\w+)\\b(?!;).*"), alias("^using (\\w+) = .*"),
      constants("^(?:inline |static |constexpr |const )+[\\w:<>,*& .]*?\\bk[A-Z]\\w*\\b.*"),
      constant("\\b(k[A-Z]\\w*)(?:\\[[^\\]]*\\])*(?: =(?!=)|[{(])"),
      function(
          "^(?!return|using|namespace|template)[A-Za-z]\\w*[\\w:<>,*& ]*[ "
          "&*]([a-z_]\\w*)\\(([^)]*)\\).*\\{.*");
  std::smatch found;
  if (std::regex_match(line, found, alias)) {
    const bool same_name = line.ends_with("::" + found[1].str() + ";");  // of another namespace
    if (same_name) return {};
    return {{found[1], line}};
  }
  if (std::regex_match(line, found, type)) return {{found[1], {}}};
  if (std::regex_match(line, constants)) {
    std::vector<Definition> definitions;
    for (std::sregex_iterator at(line.begin(), line.end(), constant), end; at != end; ++at)
      definitions.push_back({(*at)[1], {}});
    return definitions;
  }
  if (!std::regex_match(line, found, function)) return {};
  const std::string parameters = found[2];
  const auto count = parameters.empty() ? 0 : 1 + std::count(parameters.begin(), parameters.end(), ',');
  return {{found[1].str() + "(" + std::to_string(count) + ")", {}}};
}

struct Defined {
  std::string file, text;
};
using Names = std::map<std::string, Defined>;

/// Adds the names of a file; conflicts with the files before it as sentences.
std::string add_names(const std::string& name, const std::string& source, Names& names) {
  std::string conflicts;
  std::istringstream lines(source);
  for (std::string line; std::getline(lines, line);) {
    for (const Definition& definition : definitions_in(line)) {
      const auto [at, first] = names.try_emplace(definition.name, Defined{name, definition.text});
      const bool same = !definition.text.empty() && at->second.text == definition.text;
      if (!first && at->second.file != name && !same)
        conflicts += name + " and " + at->second.file + " both define " + definition.name + "\n";
    }
  }
  return conflicts;
}

/// The headers of the tests that a file includes itself.
std::vector<fs::path> headers_of(const fs::path& file, const fs::path& root) {
  static const std::regex include("#include \"([^\"]+)\"");
  const std::string source = test::bytes_of(file);
  std::vector<fs::path> headers;
  for (std::sregex_iterator at(source.begin(), source.end(), include), end; at != end; ++at) {
    const std::string name = (*at)[1];
    const fs::path path = name.starts_with("tests/") ? root / name : file.parent_path() / name;
    if (fs::exists(path)) headers.push_back(path);
  }
  return headers;
}

TEST(NamesInTests, AreDefinedOnceInEachProgram) {
  const fs::path root = PARHELION_SOURCE_DIR, tests = root / "tests";
  std::map<std::string, std::set<fs::path>> programs;
  for (const auto& entry : fs::recursive_directory_iterator(tests)) {
    const fs::path& path = entry.path();
    if (path.filename().string().ends_with("_test.cpp")) programs[path.parent_path().string()].insert(path);
  }
  ASSERT_GT(programs.size(), 20U);
  for (const auto& [folder, files] : programs) {
    std::set<fs::path> headers;
    for (const fs::path& file : files) {
      for (const fs::path& header : headers_of(file, root)) headers.insert(fs::canonical(header));
    }
    Names names;
    // Two headers may define the same name, in namespaces of their own.
    for (const fs::path& header : headers)
      add_names(header.filename().string(), test::bytes_of(header), names);
    for (const fs::path& file : files)
      EXPECT_EQ(add_names(fs::relative(file, tests).string(), test::bytes_of(file), names), "")
          << "rename one, or move it to a header";
  }
}

TEST(NamesInTests, ConflictsAreFound) {
  Names names;
  EXPECT_EQ(
      add_names("a", "struct One {\nconstexpr int kTwo = 2;\nint three(int x) {\nusing F = int;\n", names),
      "");
  EXPECT_EQ(add_names("b", "using F = int;\nint three(int x, int y) {\n  constexpr int kTwo = 3;\n", names),
            "");
  EXPECT_NE(add_names("c", "struct One {\n", names), "");
  EXPECT_NE(add_names("d", "const double kTwo = 2;\n", names), "");
  EXPECT_NE(add_names("h", "const double kFour = 2, kTwo = 2;\n", names), "");
  EXPECT_NE(add_names("e", "std::string three(const std::string& x) {\n", names), "");
  EXPECT_NE(add_names("g", "Eigen::Vector2d three(double) {\n", names), "");
  EXPECT_NE(add_names("f", "using F = double;\n", names), "");
}

}  // namespace
}  // namespace parhelion

#include "tools/records_file.hpp"

#include <cstdlib>
#include <filesystem>

namespace parhelion::tools {
namespace {

std::string default_database() {
  const char* chosen = std::getenv("PARHELION_RECORDS");
  if (chosen != nullptr && *chosen != '\0') return chosen;
  const char* base = std::getenv("XDG_DATA_HOME");
  if (base != nullptr && *base == '/') return std::string(base) + "/parhelion/records.db";
  const char* home = std::getenv("HOME");
  return home == nullptr ? "records.db" : std::string(home) + "/.local/share/parhelion/records.db";
}

}  // namespace

Result<training::Records> open_records(const std::string& chosen, bool create) {
  if (!chosen.empty()) return training::Records::open(chosen, create);
  const std::string path = default_database();
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code failed;
  if (create && !folder.empty()) std::filesystem::create_directories(folder, failed);
  if (failed) return Error{folder.string() + ": cannot be created: " + failed.message()};
  return training::Records::open(path, create);
}

}  // namespace parhelion::tools

#include "protocols/share.hpp"

#include <algorithm>
#include <cstdlib>
#include <system_error>

namespace parhelion {

std::filesystem::path share_path(std::string_view relative) {
  if (const char* chosen = std::getenv("PARHELION_SHARE"); chosen != nullptr && *chosen != '\0') {
    return std::filesystem::path(chosen) / relative;
  }
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  for (auto folder = program.parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
    auto path = folder / PARHELION_SHARE_FOLDER / relative;
    if (std::filesystem::exists(path, error)) return path;
  }
  return program.parent_path().parent_path() / PARHELION_SHARE_FOLDER / relative;  // where it is expected
}

std::vector<std::string> shipped_names(std::string_view folder) {
  std::vector<std::string> names;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(share_path(folder), code)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::optional<std::string> path_of_shipped(std::string_view folder, const std::string& name_or_path) {
  const std::vector<std::string> names = shipped_names(folder);
  if (std::find(names.begin(), names.end(), name_or_path) != names.end())
    return (share_path(folder) / (name_or_path + ".yaml")).string();
  if (std::filesystem::path(name_or_path).extension() == ".yaml") return name_or_path;
  return std::nullopt;
}

}  // namespace parhelion

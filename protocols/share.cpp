#include "protocols/share.hpp"

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

}  // namespace parhelion

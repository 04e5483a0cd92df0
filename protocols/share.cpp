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
  if (!error) {
    const auto installed = program.parent_path().parent_path() / PARHELION_SHARE_DIR / relative;
    if (std::filesystem::exists(installed, error)) return installed;
  }
  return std::filesystem::path(PARHELION_SOURCE_SHARE) / relative;
}

}  // namespace parhelion

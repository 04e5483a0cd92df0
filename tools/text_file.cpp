#include "tools/text_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace parhelion {

Status write_text(const std::string& path, const std::string& text, bool overwrite) {
  if (path == "-") {
    std::fwrite(text.data(), 1, text.size(), stdout);
    return {};
  }
  std::error_code ignored;
  if (!overwrite && std::filesystem::exists(path, ignored)) {
    return Error{path + ": exists already; choose another name or give --force"};
  }
  const std::string temporary = path + ".part";
  std::FILE* file = std::fopen(temporary.c_str(), "wb");
  if (file == nullptr) return Error{temporary + ": cannot be written: " + std::strerror(errno)};
  const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  if (std::fclose(file) != 0 || !written || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const Error error{path + ": cannot be written: " + std::strerror(errno)};
    std::remove(temporary.c_str());
    return error;
  }
  return {};
}

}  // namespace parhelion

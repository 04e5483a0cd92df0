#include "tools/text_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace parhelion::tools {

namespace fs = std::filesystem;

Status check_writable(const fs::path& path, bool overwrite) {
  if (path.empty() || path == "-") return {};
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    return Error{path.string() + ": is a folder; expected the name of a file in it"};
  const bool exists = fs::exists(path, ignored);
  if (!overwrite && exists)
    return Error{path.string() + ": exists already; choose another name or give --force"};
  if (exists && access(path.c_str(), W_OK) != 0)
    return Error{path.string() + ": cannot be overwritten: " + std::strerror(errno)};
  const fs::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (!fs::is_directory(folder, ignored))
    return Error{path.string() + ": there is no folder " + folder.string() + "; create it first"};
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    return Error{path.string() + ": the folder " + folder.string() +
                 " cannot be written: " + std::strerror(errno)};
  return {};
}

Status write_beside(const fs::path& path, const std::vector<std::string>& files,
                    const std::function<Status(const fs::path& folder)>& write) {
  const fs::path target = path.parent_path();
  const fs::path folder = path.string() + ".part";
  std::error_code failed;
  fs::create_directory(folder, failed);
  if (failed) return Error{path.string() + ": cannot be written: " + failed.message()};
  Status written = write(folder);
  for (const std::string& file : files) {
    if (!written) break;
    fs::rename(folder / file, target / file, failed);
    if (failed) written = Error{(target / file).string() + ": cannot be written: " + failed.message()};
  }
  fs::remove_all(folder, failed);
  return written;
}

Status write_text(const std::string& path, const std::string& text, bool overwrite, Readers readers) {
  if (path == "-") {
    if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
      return {};
    return Error{std::string("standard output cannot be written: ") + std::strerror(errno)};
  }
  if (const Status free = check_writable(path, overwrite); !free) return free;
  const std::string temporary = path + ".part";
  const mode_t mode = readers == Readers::owner ? S_IRUSR | S_IWUSR : 0666;
  const int opened = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode);
  std::FILE* file = opened < 0 ? nullptr : fdopen(opened, "wb");
  if (file == nullptr) return Error{temporary + ": cannot be written: " + std::strerror(errno)};
  // A leftover file keeps the permissions it was created with.
  const bool kept = readers == Readers::all || fchmod(opened, mode) == 0;
  const bool written = kept && std::fwrite(text.data(), 1, text.size(), file) == text.size();
  if (std::fclose(file) != 0 || !written || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const Error error{path + ": cannot be written: " + std::strerror(errno)};
    std::remove(temporary.c_str());
    return error;
  }
  return {};
}

}  // namespace parhelion::tools

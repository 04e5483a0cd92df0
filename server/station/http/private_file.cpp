#include "server/station/http/private_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace parhelion::station {
namespace {

Error failure(const std::filesystem::path& path, const char* what) {
  return Error{path.string() + ": cannot be " + what + ": " + std::strerror(errno)};
}

bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool sync_folder(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool synced = fsync(descriptor) == 0;
  ::close(descriptor);
  return synced;
}

}  // namespace

Status make_private_folder(const std::filesystem::path& folder) {
  std::error_code failed;
  if (folder.has_parent_path()) std::filesystem::create_directories(folder.parent_path(), failed);
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) return failure(folder, "made");
  if (!std::filesystem::is_directory(folder, failed)) return Error{folder.string() + ": is not a folder"};
  return {};
}

Status write_private_file(const std::filesystem::path& file, std::string_view text) {
  std::filesystem::path beside = file;
  beside += ".new";
  ::unlink(beside.c_str());
  const int descriptor = ::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (descriptor < 0) return failure(beside, "made");
  bool written = write_all(descriptor, text) && fsync(descriptor) == 0;
  written = ::close(descriptor) == 0 && written;
  if (!written || std::rename(beside.c_str(), file.c_str()) != 0) {
    const Error error = failure(file, "written");
    ::unlink(beside.c_str());
    return error;
  }
  if (!sync_folder(file.has_parent_path() ? file.parent_path() : "."))
    return failure(file, "kept on the disk");
  return {};
}

}  // namespace parhelion::station

#include "server/station/http/private_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace parhelion::station {
namespace {

constexpr off_t kLongestFile = 1 << 20;

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

/// What is wrong with the file of a secret; nullptr: nothing.
const char* exposure(const struct stat& attributes) {
  if (!S_ISREG(attributes.st_mode)) return "is not a file";
  if (attributes.st_uid != geteuid()) return "belongs to another user; remove it, or chown it";
  if ((attributes.st_mode & 077) != 0) return "other users can read or write it; chmod 600 it";
  return attributes.st_size > kLongestFile ? "is longer than 1 MiB" : nullptr;
}

/// False: errno says why.
bool read_all(int file, std::string& text) {
  std::array<char, 4096> bytes{};
  while (true) {
    const ssize_t got = ::read(file, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return got == 0;
    text.append(bytes.data(), static_cast<std::size_t>(got));
  }
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

Status check_private_folder(const std::filesystem::path& folder) {
  struct stat attributes {};
  if (stat(folder.c_str(), &attributes) != 0 || (attributes.st_mode & (S_IWGRP | S_IWOTH)) == 0) return {};
  return Error{folder.string() + ": other users may change what is in this folder; run: chmod 700 " +
               folder.string()};
}

Result<std::optional<std::string>> read_private_file(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0 && errno == ENOENT) return std::optional<std::string>();
  if (descriptor < 0 && errno == ELOOP) return Error{file.string() + ": is a link; expected the file itself"};
  if (descriptor < 0) return failure(file, "read");
  struct stat attributes {};
  std::string text;
  const bool known = fstat(descriptor, &attributes) == 0;
  const char* wrong = known ? exposure(attributes) : nullptr;
  const bool read = known && !wrong && read_all(descriptor, text);
  const Error error = wrong ? Error{file.string() + ": " + wrong} : failure(file, "read");
  ::close(descriptor);
  if (!read) return error;
  return std::optional(std::move(text));
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

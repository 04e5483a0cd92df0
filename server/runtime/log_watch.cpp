#include "server/runtime/log_watch.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

namespace parhelion::runtime {

LogWatch::LogWatch(std::string path)
    : path_(std::move(path)), file_(path_.empty() ? -1 : open(path_.c_str(), O_PATH | O_CLOEXEC)) {}

LogWatch::~LogWatch() {
  if (file_ >= 0) close(file_);
}

Status LogWatch::check() const {
  if (path_.empty()) return {};
  struct stat written {
  }, found{};
  const bool there = stat(path_.c_str(), &found) == 0;
  // Any other failure, as of a network file system, says nothing about the file.
  if (!there && errno != ENOENT && errno != ENOTDIR) return {};
  if (there && fstat(file_, &written) == 0 && written.st_ino == found.st_ino &&
      written.st_dev == found.st_dev)
    return {};
  return Error{path_ + ": " + (there ? "replaced by another file" : "deleted or moved") +
               " during the session; nothing more is kept: start a new session"};
}

}  // namespace parhelion::runtime

// A file in memory that is opened by its path.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "protocols/codec.hpp"

namespace parhelion::fuzz {

class MemoryFile {
 public:
  MemoryFile() : file_(memfd_create("parhelion-fuzz", 0)), path_("/proc/self/fd/" + std::to_string(file_)) {
    if (file_ < 0) std::abort();
  }
  /// Replaces the content; returns the path.
  const std::string& hold(Bytes bytes) const {
    if (ftruncate(file_, 0) != 0) std::abort();
    if (pwrite(file_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) std::abort();
    return path_;
  }

 private:
  int file_;
  std::string path_;
};

}  // namespace parhelion::fuzz

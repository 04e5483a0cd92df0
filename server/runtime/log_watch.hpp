// Notices that a session log was deleted, moved or replaced while it is being written: all writes to it
// succeed, and nobody finds it afterwards.
#pragma once

#include <string>

#include "protocols/status.hpp"

namespace parhelion::runtime {

class LogWatch {
 public:
  /// `path`: of a file that exists; empty: nothing is watched.
  explicit LogWatch(std::string path);
  ~LogWatch();
  LogWatch(const LogWatch&) = delete;
  LogWatch& operator=(const LogWatch&) = delete;

  /// Error: the path does not lead to the file any more.
  Status check() const;

 private:
  const std::string path_;
  const int file_;
};

}  // namespace parhelion::runtime

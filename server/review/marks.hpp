// The instructor's marks of a session, from the notes that the base station keeps beside its log.
#pragma once

#include <string>
#include <vector>

namespace parhelion::review {

struct Mark {
  double t = 0;  ///< s after the session's begin
  std::string by, text;
};

/// File of chat and marks of the session with this log.
std::string notes_path(const std::string& log);

/// Ordered by time; empty where there is no file. Lines that are no marks are skipped.
std::vector<Mark> read_marks(const std::string& notes);

}  // namespace parhelion::review

#include "tools/service/service_log.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>

#include "tools/topic_text.hpp"

namespace parhelion::tools {
namespace {

/// JOURNAL_STREAM names the journal's stream; standard error may have been redirected since it was set.
bool is_journal(int file) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat found {};
  if (stream == nullptr || fstat(file, &found) != 0) return false;
  return std::to_string(found.st_dev) + ":" + std::to_string(found.st_ino) == stream;
}

}  // namespace

void log_line(Priority priority, const std::string& text) {
  static const bool journal = is_journal(STDERR_FILENO);
  if (journal) std::fprintf(stderr, "<%d>", static_cast<int>(priority));
  // Parts of it may come from the bus: terminals obey control characters.
  std::fprintf(stderr, "parhelion serve: %s\n", printable(text, true).c_str());
}

}  // namespace parhelion::tools

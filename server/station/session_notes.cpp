#include "server/station/session_notes.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace parhelion::station {

Result<SessionNotes> SessionNotes::open(const std::string& path) {
  SessionNotes notes;
  notes.path_ = path;
  if (path.empty()) return notes;
  // What people write is theirs alone, and a link that somebody planted is not followed.
  const int descriptor =
      ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor >= 0 && fchmod(descriptor, S_IRUSR | S_IWUSR) == 0)
    notes.file_.reset(fdopen(descriptor, "a"));
  if (!notes.file_) {
    const Error error{path + ": chat and marks cannot be stored here: " + std::strerror(errno) +
                      "; expected a writable folder, and no link"};
    if (descriptor >= 0) close(descriptor);
    return error;
  }
  return notes;
}

Status SessionNotes::write(const std::string& by, const std::string& json, WallTime now) {
  if (!file_) return {};
  std::size_t& bytes = note_bytes_[by];
  if (bytes + json.size() > kMaxNoteBytes) return Error{"'" + by + "' has reached the limit for one person"};
  bytes += json.size();
  const std::string line = "{\"at_us\":" + std::to_string(now.utime()) + "," + json.substr(1) + "\n";
  const bool written = std::fwrite(line.data(), 1, line.size(), file_.get()) == line.size();
  if (written && std::fflush(file_.get()) == 0) return {};
  return Error{path_ + ": " + std::strerror(errno)};
}

Status SessionNotes::add(const ChatLine& line, WallTime now) {
  chat_.push_back(line);
  if (chat_.size() > kKept) chat_.pop_front();
  return write(line.from, chat_json(line), now);
}

Status SessionNotes::add(const MarkLine& line, WallTime now) {
  marks_.push_back(line);
  if (marks_.size() > kKept) marks_.pop_front();
  return write(line.by, mark_json(line), now);
}

bool is_for(const ChatLine& line, const Identity& who) {
  const bool everybody = !line.to_role && line.to_person.empty();
  return everybody || line.to_role == who.role || line.to_person == who.name || line.from == who.name;
}

}  // namespace parhelion::station

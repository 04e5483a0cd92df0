// Chat lines and marks of a session, stored beside its log, never in it and never on LCM.
#pragma once

#include <cstdio>
#include <deque>
#include <map>
#include <memory>
#include <string>

#include "server/station/feed_json.hpp"

namespace parhelion::station {

class SessionNotes {
 public:
  /// Appends to `path`, a JSON object per line ({"at_us", and the message to the page}); empty: kept in
  /// memory only. Error: it cannot be written.
  static Result<SessionNotes> open(const std::string& path);

  /// Error: the line was not written, because the file failed or this person's quota in it is full. The line
  /// is kept in memory all the same.
  Status add(const ChatLine& line, WallTime now);
  Status add(const MarkLine& line, WallTime now);

  /// The newest lines.
  const std::deque<ChatLine>& chat() const { return chat_; }
  const std::deque<MarkLine>& marks() const { return marks_; }

 private:
  static constexpr std::size_t kKept = 500;                // of each kind, in memory
  static constexpr std::size_t kMaxNoteBytes = 1'000'000;  // maximum bytes of one person in the file
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  Status write(const std::string& by, const std::string& json, WallTime now);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::map<std::string, std::size_t> note_bytes_;  // bytes, by person
  std::deque<ChatLine> chat_;
  std::deque<MarkLine> marks_;
};

/// True if this person may read the line.
bool is_for(const ChatLine& line, const Identity& who);

}  // namespace parhelion::station

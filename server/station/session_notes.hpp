// What people say and mark while a session runs: kept beside its log, never in it and never on LCM.
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
  /// Appends to `path`, a JSON object a line ({"at_us", and what the page was told}); empty: kept in memory
  /// alone. Error: it cannot be written.
  static Result<SessionNotes> open(const std::string& path);

  /// Error: the line was not written, as the file cannot be or is full of this person's words; it is kept in
  /// memory all the same.
  Status add(const ChatLine& line, WallTime now);
  Status add(const MarkLine& line, WallTime now);

  /// The newest of them.
  const std::deque<ChatLine>& chat() const { return chat_; }
  const std::deque<MarkLine>& marks() const { return marks_; }

 private:
  static constexpr std::size_t kept = 500;             // of each, in memory
  static constexpr std::size_t most_said = 1'000'000;  // bytes that one person's words may take of the file
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  Status write(const std::string& by, const std::string& json, WallTime now);

  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
  std::map<std::string, std::size_t> said_;  // bytes, by person
  std::deque<ChatLine> chat_;
  std::deque<MarkLine> marks_;
};

/// Whether the line is for this person to read.
bool is_for(const ChatLine& line, const Identity& who);

}  // namespace parhelion::station

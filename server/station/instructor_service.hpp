// Handles requests of pages: the instructor's commands, marks, chat, pause and end. Checks permissions, and
// records in the audit log what was done or refused.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "protocols/bus/bus.hpp"
#include "server/station/session_notes.hpp"
#include "server/station/state_feed.hpp"

namespace parhelion::station {

/// Actor, action and result ("done", or the reason for a refusal).
using AuditHook = std::function<void(const Identity& who, const std::string& remote, const std::string& what,
                                     const std::string& outcome)>;
/// Latches the emergency stop of a robot (empty: the trainee's), or releases it.
using StopHook = std::function<Status(bool on, const std::string& robot, const Identity& who)>;

struct InstructorOptions {
  SessionControls controls;
  StopHook emergency_stop;  ///< empty: not available
  std::string scenarios;    ///< folder for saved scenarios; empty: saving is disabled
  AuditHook audit;          ///< may be empty
};

/// Not thread-safe: used by the station's worker only.
class InstructorService {
 public:
  InstructorService(Bus& bus, StateFeed& feed, SessionNotes notes, InstructorOptions options);

  /// `now`: steady clock.
  void receive(WebClient& client, std::string_view text, WallTime now);
  /// An event that may be the reply to a command.
  void handle(const Event& event);
  /// Drops commands without a reply after a timeout.
  void look(WallTime now);
  /// Sends the chat lines and marks from before the page was opened. Trainees get no marks.
  void greet(WebClient& client) const;

 private:
  struct Asked {
    std::uint64_t client = 0, request = 0;
    Identity who;
    std::string remote, what;
    WallTime at;
  };
  Status check_rate(Subscriber& subscriber, WallTime now) const;
  Status check_delay(const ClientMessage& message, WallTime now) const;
  Result<std::string> execute(WebClient& client, const ClientMessage& message);
  Result<std::string> control(const ClientMessage& message);
  Result<std::string> save(const ClientMessage& message);
  Result<std::string> send_chat(WebClient& client, const ClientMessage& message);
  Result<std::string> mark(const WebClient& client, const ClientMessage& message);
  Status send(WebClient& client, ClientMessage message, WallTime now);
  void answer(WebClient& client, std::uint64_t request, const Status& done, const std::string& text) const;
  void note(const Identity& who, const std::string& remote, const std::string& what,
            const Status& done) const;

  Bus& bus_;
  StateFeed& feed_;
  SessionNotes notes_;
  InstructorOptions options_;
  std::map<std::uint64_t, Asked> asked_;  ///< by the request on the bus
  std::uint64_t next_request_;
  std::vector<std::uint8_t> payload_;
};

/// True if a role may send this message; `recorded`: a recording is shown, and observers may control the
/// playback.
bool may(Role role, ClientMessage::Kind kind, bool recorded);

}  // namespace parhelion::station

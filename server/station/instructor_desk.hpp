// What pages ask for: the instructor's commands to the bus and back, marks, words between people, pause
// and end. Who may do what is decided here, and what was done or refused is told to the audit.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "protocols/bus/bus.hpp"
#include "server/station/session_notes.hpp"
#include "server/station/state_feed.hpp"

namespace parhelion::station {

/// Who did what, and how it ended ("done", or why not).
using DeskAudit = std::function<void(const Identity& who, const std::string& remote, const std::string& what,
                                     const std::string& outcome)>;
/// Latches the emergency stop of a robot (empty: the trainee's), or takes it back.
using StopHook = std::function<Status(bool on, const std::string& robot, const Identity& who)>;

struct DeskOptions {
  SessionControls controls;
  StopHook emergency_stop;  ///< empty: there is none
  std::string scenarios;    ///< folder that saved scenarios go to; empty: none are kept
  DeskAudit audit;          ///< may be empty
};

/// Not thread-safe: the station's worker has it.
class InstructorDesk {
 public:
  InstructorDesk(Bus& bus, StateFeed& feed, SessionNotes notes, DeskOptions options);

  /// `now`: steady clock.
  void receive(WebClient& client, std::string_view text, WallTime now);
  /// An event that may answer a command.
  void hear(const Event& event);
  /// Commands that nobody answers are given up.
  void look(WallTime now);
  /// What was said and marked before the page was opened.
  void greet(WebClient& client) const;

 private:
  struct Asked {
    std::uint64_t client = 0, request = 0;
    Identity who;
    std::string remote, what;
    WallTime at;
  };
  Status check_rate(Page& page, WallTime now) const;
  Result<std::string> obey(WebClient& client, const PageMessage& message);
  Result<std::string> control(const PageMessage& message);
  Result<std::string> save(const PageMessage& message);
  Result<std::string> say(WebClient& client, const PageMessage& message);
  Result<std::string> mark(const WebClient& client, const PageMessage& message);
  Status send(WebClient& client, PageMessage message, WallTime now);
  void answer(WebClient& client, std::uint64_t request, const Status& done, const std::string& text) const;
  void note(const Identity& who, const std::string& remote, const std::string& what,
            const Status& done) const;

  Bus& bus_;
  StateFeed& feed_;
  SessionNotes notes_;
  DeskOptions options_;
  std::map<std::uint64_t, Asked> asked_;  ///< by the request on the bus
  std::uint64_t next_request_;
  std::vector<std::uint8_t> payload_;
};

/// Whether a role may say this; `recorded`: nothing is live, and who may look may wind.
bool may(Role role, PageMessage::Kind kind, bool recorded);

}  // namespace parhelion::station

// What a page says on /ws/state, checked against page_messages.schema.json before anything is done about it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/instructor_command.hpp"
#include "protocols/status.hpp"

namespace parhelion::station {

/// What of the session a page wants to be sent.
struct Subscription {
  bool scan = true;
  bool points = false;
  double world_hz = 30;                  ///< of the binary world, at most
  std::vector<std::string> agent_scans;  ///< agents whose own scans are wanted
};

struct PageMessage {
  enum class Kind : std::uint8_t {
    subscribe,
    agent,  ///< `command`: so too of script, lesson and report
    script,
    lesson,
    end,
    save,  ///< `name`
    report,
    chat,  ///< `name` is whom it is for
    mark,
    pause,
    resume,
    step,
    rate,   ///< `value`
    seek,   ///< `value`, s
    estop,  ///< `name` of the robot; empty: the trainee's
    estop_reset,
  };
  Kind kind = Kind::subscribe;
  std::uint64_t request = 0;  ///< comes back in the reply; 0: none was given
  Subscription subscription;
  InstructorCommand command;  ///< without stamp and request, which the desk gives
  std::string name, text;
  double value = 0;
};
const char* to_string(PageMessage::Kind kind);

/// Longer ones are refused unread.
inline constexpr std::size_t kLongestPageMessage = 64 * 1024;  // bytes

/// Error: what is wrong, by its key, and what was expected; `request` is set as far as the message says one.
Result<PageMessage> read_page_message(std::string_view text, std::uint64_t& request);

}  // namespace parhelion::station

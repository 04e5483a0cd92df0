// Messages of pages on /ws/state, validated against client_messages.schema.json.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/instructor_command.hpp"
#include "protocols/status.hpp"
#include "server/station/http/identity.hpp"

namespace parhelion::station {

/// The parts of the session that a page subscribes to.
struct Subscription {
  std::string robot;  ///< the trainee's robot that the page follows; empty: the first
  bool scan = true;
  bool points = false;
  double world_hz = 30;                  ///< maximum rate of the binary world message
  std::vector<std::string> agent_scans;  ///< agents whose own scans are wanted
};

struct ClientMessage {
  enum class Kind : std::uint8_t {
    subscribe,
    agent,  ///< `command`; also for script, fault, start and report
    script,
    fault,
    start,
    end,
    save,  ///< `name`
    report,
    chat,  ///< to `role`, or to the person `name`; neither: to everybody
    mark,
    pause,
    resume,
    step,
    rate,   ///< `value`
    seek,   ///< `value`, s
    estop,  ///< `name` of the robot; empty: the trainee's
    estop_release,
  };
  Kind kind = Kind::subscribe;
  std::uint64_t request = 0;   ///< repeated in the reply; 0: none
  std::optional<double> seen;  ///< s of the session, that the page's last `control` had when it sent this
  Subscription subscription;
  InstructorCommand command;  ///< without stamp and request, which the instructor service adds
  std::string name, text;
  std::optional<Role> role;
  double value = 0;
};
const char* to_string(ClientMessage::Kind kind);

/// Longer messages are refused unread.
inline constexpr std::size_t kMaxClientMessage = 64 * 1024;  // bytes

/// The error contains the offending key and what was expected; `request` is set if the message has one.
Result<ClientMessage> read_client_message(std::string_view text, std::uint64_t& request);

}  // namespace parhelion::station

#include "server/tick/tally.hpp"

namespace parhelion::tick {

const char* to_string(Degraded why) {
  switch (why) {
    case Degraded::none:
      return "none";
    case Degraded::pose:
      return "pose";
    case Degraded::error:
      return "predicted_error";
    case Degraded::clock:
      return "clock";
    case Degraded::history:
      return "history";
    case Degraded::unreadable:
      return "unreadable";
    case Degraded::guard:
      return "guard";
    case Degraded::fault:
      return "fault";
    case Degraded::no_beam:
      return "no_beam";
  }
  return "?";
}

}  // namespace parhelion::tick

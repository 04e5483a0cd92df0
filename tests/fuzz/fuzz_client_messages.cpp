// Messages of clients on /ws/state, /ws/teleop and /ws/video: no crash, no hang; what is accepted is within
// its bounds, and goes to the bus and back.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "protocols/codec.hpp"
#include "server/station/client_messages.hpp"
#include "server/station/teleop_messages.hpp"
#include "server/station/video/video_messages.hpp"

namespace {

using namespace parhelion;

void check(bool holds) {
  if (!holds) std::abort();
}

/// A command that passed the schema is one that the server can read, or says by name why it cannot be.
void check_command(const InstructorCommand& command) {
  std::vector<std::uint8_t> payload;
  encode(command, payload);
  std::optional<InstructorCommand> again = command_on(channel_of(command));
  check(again.has_value() && again->index() == command.index());
  const Status read = decode(channel_of(command), payload, *again);
  check(read.ok() || !read.error().message.empty());
  if (!read) return;
  check(std::string_view(action_of(*again)) == action_of(command) &&
        subject_of(*again) == subject_of(command));
  check(position_of(*again).allFinite());
}

void check_client_message(std::string_view text) {
  std::uint64_t request = 0;
  const auto message = station::read_client_message(text, request);
  if (!message) return check(!message.error().message.empty());
  check(message->request == request && text.size() <= station::kMaxClientMessage);
  check(std::isfinite(message->value) && message->name.size() <= 4 * 64 && message->text.size() <= 4 * 2000);
  check(message->subscription.world_hz >= 1 && message->subscription.world_hz <= 30);
  check(message->subscription.agent_scans.size() <= 8);
  using Kind = station::ClientMessage::Kind;
  const Kind kind = message->kind;
  if (kind == Kind::agent || kind == Kind::script || kind == Kind::fault || kind == Kind::report)
    check_command(message->command);
  if (kind == Kind::save) check(message->name.find_first_of("./\\") == std::string::npos);
}

void check_teleop(std::string_view text) {
  const auto request = station::read_teleop_request(text);
  if (!request) return check(!request.error().message.empty());
  check(std::isfinite(request->twist.vx) && std::isfinite(request->twist.vy) &&
        std::isfinite(request->twist.wz));
  check(request->names.size() == request->velocities.size());
  for (const double velocity : request->velocities) check(std::isfinite(velocity));
}

void check_video(std::string_view text) {
  const auto request = station::read_video_request(text);
  if (!request) return check(!request.error().message.empty());
  if (request->kind != station::VideoRequest::Kind::clock) return;
  check(std::isfinite(request->at_ms) && !station::clock_text(request->at_ms, 0).empty());
}

void check_all(std::string_view text) {
  check_client_message(text);
  check_teleop(text);
  check_video(text);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  check_all(text);
  // What comes after a type that there is: the schemas are behind it.
  static constexpr const char* types[] = {
      "subscribe", "agent", "script", "fault",   "end",    "save", "report", "chat", "mark", "control",
      "estop",     "drive", "twist",  "release", "joints", "ping", "ack",    "key",  "clock"};
  if (text.empty()) return 0;
  const char* type = types[bytes[0] % std::size(types)];
  const std::string whole = std::string(R"({"type":")") + type + "\"," + std::string(text.substr(1)) + "}";
  check_all(whole);
  return 0;
}

#include "server/station/video/video_messages.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

namespace parhelion::station {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kLongest = 1024;  // bytes of a page's message
constexpr char kFrameKind = 5;

template <class T>
void put(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little, "the header is written as it lies in memory");
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

const char* to_string(VideoStatus::State state) {
  switch (state) {
    case VideoStatus::State::none:
      return "none";
    case VideoStatus::State::live:
      return "live";
    case VideoStatus::State::stale:
      return "stale";
  }
  return "none";
}

std::string dump(const Json& message) { return message.dump(-1, ' ', false, Json::error_handler_t::replace); }

/// NaN: missing, or not a finite number.
double number(const Json& message, const char* key) {
  const auto found = message.find(key);
  return found != message.end() && found->is_number() ? found->get<double>() : std::nan("");
}

}  // namespace

std::shared_ptr<const std::string> video_message(const VideoFrame& frame,
                                                 std::span<const std::uint8_t> bytes) {
  auto message = std::make_shared<std::string>();
  message->reserve(kVideoHeader + bytes.size());
  put(*message, kFrameKind);
  put(*message, static_cast<std::uint8_t>(frame.codec));
  put(*message, static_cast<std::uint8_t>(frame.key));
  put(*message, static_cast<std::uint8_t>(frame.state));
  put(*message, frame.sequence);
  put(*message, frame.stamp_us);
  put(*message, frame.server_us);
  put(*message, frame.drawn_us);
  put(*message, static_cast<std::uint16_t>(frame.width));
  put(*message, static_cast<std::uint16_t>(frame.height));
  message->append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return message;
}

std::string video_status_text(const VideoStatus& status) {
  return dump({{"type", "video"},
               {"robot", status.robot},
               {"state", to_string(status.state)},
               {"why", status.why},
               {"robots", status.robots},
               {"codec", status.codec == VideoCodec::h264 ? "h264" : "jpeg"},
               {"bit_rate", status.bit_rate},
               {"clock_off_s", status.clock_off_s}});
}

Result<VideoRequest> read_video_request(std::string_view text) {
  if (text.size() > kLongest) return Error{"a message of more than 1024 bytes"};
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object()) return Error{"expected a JSON object with a \"type\""};
  const auto type = message.find("type");
  const std::string word = type != message.end() && type->is_string() ? type->get<std::string>() : "";
  VideoRequest request;
  if (word == "key") return request;
  request.at_ms = number(message, "at_ms");
  if (word == "clock") {
    request.kind = VideoRequest::Kind::clock;
    if (!std::isfinite(request.at_ms)) return Error{"'clock': expected 'at_ms', a number"};
    return request;
  }
  if (word != "ack") return Error{"'type': expected ack, key or clock"};
  request.kind = VideoRequest::Kind::ack;
  const double sequence = number(message, "sequence");
  if (!(sequence >= 0 && sequence <= 4294967295.0 && sequence == std::floor(sequence)))
    return Error{"'ack': expected 'sequence' from a frame's header"};
  request.sequence = static_cast<std::uint32_t>(sequence);
  return request;
}

std::string clock_text(double at_ms, std::int64_t server_us) {
  return dump({{"type", "clock"}, {"at_ms", at_ms}, {"server_us", server_us}});
}

}  // namespace parhelion::station

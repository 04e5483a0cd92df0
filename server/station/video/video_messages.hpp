// Messages on /ws/video: frames with their header, the state of the picture, and replies of a page.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/status.hpp"

namespace parhelion::station {

enum class VideoCodec : std::uint8_t { h264, jpeg };
enum class PictureState : std::uint8_t {
  live,      ///< real, with virtual bodies drawn in
  original,  ///< real, without virtual bodies
  simulated,
};

struct VideoFrame {
  VideoCodec codec = VideoCodec::h264;
  bool key = true;  ///< a key frame: decodes without earlier frames
  PictureState state = PictureState::live;
  std::uint32_t sequence = 0;
  std::int64_t stamp_us = 0;   ///< of the exposure, the server's clock
  std::int64_t server_us = 0;  ///< time of sending, the server's clock
  std::int64_t drawn_us = 0;   ///< time before encoding, the server's clock
  int width = 0, height = 0;   ///< pixels
};
inline constexpr std::size_t kVideoHeader = 36;  // bytes

/// A header of 36 bytes, little-endian, and the coded picture: u8 5, u8 codec, u8 key, u8 state, u32
/// sequence, i64 stamp_us, i64 server_us, i64 drawn_us, u16 width, u16 height.
std::shared_ptr<const std::string> video_message(const VideoFrame& frame,
                                                 std::span<const std::uint8_t> bytes);

struct VideoStatus {
  enum class State : std::uint8_t { none, live, stale };
  std::string robot;
  State state = State::none;
  std::string why;                  ///< for none and stale, and for a picture that is not composited
  std::vector<std::string> robots;  ///< available robots
  VideoCodec codec = VideoCodec::h264;
  int bit_rate = 0;        ///< target, bit/s; 0: unknown
  double clock_off_s = 0;  ///< lag of the robot's clock behind the server's; 0: none
  bool operator==(const VideoStatus&) const = default;
};
std::string video_status_text(const VideoStatus& status);

struct VideoRequest {
  enum class Kind : std::uint8_t { ack, key, clock };
  Kind kind = Kind::key;
  std::uint32_t sequence = 0;
  double at_ms = 0;  ///< the page's clock
};
/// Error: not one of these messages; it describes what was expected.
Result<VideoRequest> read_video_request(std::string_view text);
std::string clock_text(double at_ms, std::int64_t server_us);

}  // namespace parhelion::station

// What one page's link carries: from what waits to be sent and what the page says it has, the bit rate that
// it can take, and whether it has fallen behind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "protocols/time.hpp"
#include "server/station/running_minimum.hpp"

namespace parhelion::station {

struct VideoLinkLimits {
  int floor = 150'000, start = 2'000'000, most = 4'000'000;  ///< bit/s
};

/// Not thread-safe. Instants are one steady clock. A page that never says what it has is judged by what
/// waits.
class VideoLink {
 public:
  explicit VideoLink(VideoLinkLimits limits = {}) : limits_(limits), bit_rate_(limits.start) {}

  void sent(std::uint32_t sequence, WallTime now);
  /// The page has this frame, and those before it.
  void acknowledged(std::uint32_t sequence, WallTime now);
  /// `waiting`: bytes that the kernel has not taken yet. Before each frame.
  void look(std::size_t waiting, WallTime now);

  int bit_rate() const { return bit_rate_; }
  /// Frames come later than they could: whoever may leave some out does.
  bool congested() const { return congested_; }
  /// Too far behind for any frame, until it has caught up.
  bool lags() const { return lags_; }
  /// The way there and back at its fastest; none: the page has acknowledged nothing.
  std::optional<Duration> round_trip() const { return round_trip_; }

 private:
  struct Sent {
    std::uint32_t sequence;
    WallTime at;
  };
  /// By how much the oldest frame that is on its way is late.
  Duration overdue(WallTime now) const;
  void follow(WallTime now);

  VideoLinkLimits limits_;
  int bit_rate_;
  bool congested_ = false, lags_ = false;
  std::deque<Sent> on_their_way_;
  RunningMinimum fastest_{seconds(30)};
  std::optional<Duration> round_trip_;
  std::optional<WallTime> heard_, changed_;
};

}  // namespace parhelion::station

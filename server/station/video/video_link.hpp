// Congestion control for the link to one page: estimates the bit rate and congestion from the bytes waiting
// to be sent and from the page's acknowledgements.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "protocols/time.hpp"
#include "server/station/running_minimum.hpp"

namespace parhelion::station {

struct VideoLinkLimits {
  int floor = 150'000, start = 2'000'000, ceiling = 4'000'000;  ///< bit/s
};

/// Not thread-safe. Instants are of one steady clock. For a page without acknowledgements, only the waiting
/// bytes count.
class VideoLink {
 public:
  explicit VideoLink(VideoLinkLimits limits = {}) : limits_(limits), bit_rate_(limits.start) {}

  void sent(std::uint32_t sequence, WallTime now);
  /// The page has received this frame and all before it.
  void acknowledged(std::uint32_t sequence, WallTime now);
  /// `waiting`: bytes that the kernel has not accepted yet. Call before each frame.
  void look(std::size_t waiting, WallTime now);

  int bit_rate() const { return bit_rate_; }
  /// Frames are delayed: optional frames should be left out.
  bool congested() const { return congested_; }
  /// Too far behind for any frame until it has caught up.
  bool lags() const { return lags_; }
  /// Minimum round-trip time; none: no acknowledgement yet.
  std::optional<Duration> round_trip() const { return round_trip_; }

 private:
  struct Sent {
    std::uint32_t sequence;
    WallTime at;
  };
  /// Delay of the oldest unacknowledged frame in excess of the expected one.
  Duration overdue(WallTime now) const;
  void follow(WallTime now);

  VideoLinkLimits limits_;
  int bit_rate_;
  bool congested_ = false, lags_ = false;
  std::deque<Sent> in_flight_;
  RunningMinimum fastest_{seconds(30)};
  std::optional<Duration> round_trip_;
  std::optional<WallTime> last_acknowledged_, changed_;
};

}  // namespace parhelion::station

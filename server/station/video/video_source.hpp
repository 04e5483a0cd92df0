// One robot's camera: selects the channel to show, and keeps the state and age of its picture.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "protocols/image.hpp"
#include "protocols/time.hpp"
#include "server/station/video/picture_age.hpp"
#include "server/station/video/video_coder.hpp"
#include "server/station/video/video_messages.hpp"

namespace parhelion::station {

/// Not thread-safe, but `coder` may be used while the rest is locked elsewhere.
class VideoSource {
 public:
  struct Waiting {
    WallTime due;  ///< earliest time to show it, steady clock
    Image image;
    bool original = false;  ///< from the camera's own channel
    ArrivalTime arrived;    ///< from the bus, before encoding
  };

  /// `original`: the camera's own channel, shown while `channel` delivers nothing; empty: none.
  VideoSource(std::string robot, std::string channel, std::string original, bool simulated);

  const std::string& robot() const { return robot_; }
  const std::string& channel() const { return channel_; }
  const std::string& original_channel() const { return original_; }

  /// True if a message on this channel is to be shown now.
  bool accepts(const std::string& channel, WallTime now);
  /// For a fault: true if the next picture belongs to the dropped fraction. Deterministic.
  bool is_lost(double fraction);
  /// The newest due picture; older ones are dropped.
  std::optional<Waiting> take_due(WallTime now);
  /// Its header, without size and coding. `session`: now on the session's axis; `wall`: now.
  VideoFrame shown(const Waiting& picture, SensorTime session, SensorTime wall, WallTime now);
  /// Live, none yet or stale, with the reason.
  VideoStatus status(WallTime now) const;

  VideoCoder coder;
  std::deque<Waiting> waiting;
  std::string fault;              ///< why the last picture could not be shown, or empty
  std::optional<WallTime> keyed;  ///< time of the last key frame

 private:
  std::string robot_, channel_, original_;
  bool simulated_;
  PictureAge age_;
  std::uint32_t sequence_ = 0;
  std::uint64_t counted_ = 0;
  std::optional<WallTime> last_message_, shown_;
  Duration period_;  // between the last two shown pictures
  std::string why_;
};

}  // namespace parhelion::station

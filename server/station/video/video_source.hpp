// One robot's camera: which of its channels is shown, what is known of the picture, and when it is stale.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "protocols/image.hpp"
#include "protocols/time.hpp"
#include "server/station/video/picture_age.hpp"
#include "server/station/video/video_coder.hpp"
#include "server/station/video/video_words.hpp"

namespace parhelion::station {

/// Not thread-safe, but `coder` may be used while the rest is locked elsewhere.
class VideoSource {
 public:
  struct Waiting {
    WallTime due;  ///< to be shown from then, steady clock
    Image image;
    bool original = false;  ///< off the camera's own channel
    ArrivalTime arrived;    ///< from the bus: drawn, not coded yet
  };

  /// `original`: the camera's own channel, shown while nothing comes on `channel`; empty: there is none.
  VideoSource(std::string robot, std::string channel, std::string original, bool simulated);

  const std::string& robot() const { return robot_; }
  const std::string& channel() const { return channel_; }
  const std::string& original_channel() const { return original_; }

  /// Whether a message on this channel, now, is to be shown.
  bool hears(const std::string& channel, WallTime now);
  /// For a lesson: whether the next picture is one of the share that is lost. The same ones each time.
  bool is_lost(double share);
  /// The newest that is due; those before it are dropped.
  std::optional<Waiting> take_due(WallTime now);
  /// Its header, but for size and coding. `session`: now on the session's axis; `wall`: now.
  VideoFrame shown(const Waiting& picture, SensorTime session, SensorTime wall, WallTime now);
  /// Live, none yet or stale, and why.
  VideoStatus status(WallTime now) const;

  VideoCoder coder;
  std::deque<Waiting> waiting;
  std::string fault;              ///< why the last picture could not be shown, or empty
  std::optional<WallTime> keyed;  ///< when the last key picture was made

 private:
  std::string robot_, channel_, original_;
  bool simulated_;
  PictureAge age_;
  std::uint32_t sequence_ = 0;
  std::uint64_t counted_ = 0;
  std::optional<WallTime> heard_, shown_;
  Duration period_;  // between the last two that were shown
  std::string why_;
};

}  // namespace parhelion::station

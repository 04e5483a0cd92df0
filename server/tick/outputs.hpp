// Outputs of one tick: messages in order, jobs for the render thread, MR_SCAN ahead of the rest, and stage
// marks for measurement.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/channels.hpp"
#include "protocols/model.hpp"
#include "render/compositor.hpp"

namespace parhelion::tick {

/// Stages of a tick, in the order in which they end. `encode` is the encoding of MR_SCAN.
enum class Stage : std::uint8_t {
  physics_step,
  agents,
  physics_wait,
  decode,
  pose,
  world,
  cast,
  augment,
  encode
};

/// Receives a mark at the end of each stage, to measure it. The tick itself reads no clock.
class StageObserver {
 public:
  virtual ~StageObserver() = default;
  virtual void ended(Stage) {}
};

/// The number of a scan or an image in records of a session (LoopDecision, noise): `sequence`, its number
/// among those of its robot and sensor, from 1, with their indices above. For the first laser or camera of
/// the first robot it is `sequence`.
constexpr std::uint64_t record_number(std::size_t robot, std::uint64_t sequence, std::size_t sensor = 0) {
  return std::uint64_t{sensor} << 56 | std::uint64_t{robot} << 48 | sequence;
}

/// Receives MR_SCAN as soon as it is computed, in the middle of the tick: the robot does not wait for the
/// server's own use of the scan.
class ScanSink {
 public:
  struct Receipt {
    bool sent = false;  ///< MR_SCAN is on the bus; otherwise it is published with the other outputs
    bool raw = false;   ///< the raw scan was published as MR_SCAN: the guard fired first
  };
  virtual ~ScanSink() = default;
  /// `number`: of the scan in this session, see record_number().
  virtual Receipt publish(std::uint64_t number, std::span<const std::uint8_t> mr_scan) = 0;
};

/// MR_SCAN is published with the other outputs.
class DeferredScanSink : public ScanSink {
 public:
  Receipt publish(std::uint64_t, std::span<const std::uint8_t>) override { return {}; }
};

/// Reused from tick to tick, so that messages keep their capacity.
class Outputs {
 public:
  struct Entry {
    std::string channel;  ///< name on the bus
    std::vector<std::uint8_t> payload;
    bool sent = false;  ///< already on the bus, only to be logged
  };
  /// An image for the render thread, with its world at the image's instant.
  struct Frame {
    render::RenderJob job;
    std::uint64_t sequence = 0;                  ///< number of the camera frame, see record_number()
    std::shared_ptr<const SemanticModel> model;  ///< the building; null: that of the session's start
    std::string reason;  ///< why nothing is drawn: the original is published, in order
    /// Of a simulated robot's camera: there is no image yet, the whole image is rendered.
    std::optional<render::Exposure> exposure;
    std::string agent;  ///< owner of the camera; empty: the robot of this index
    std::size_t robot = 0;
    std::size_t camera = 0;  ///< of that robot, see RobotDescription::camera_at()
  };

  void clear() {
    used_ = 0;
    frames_.clear();
  }
  /// Adds a message on `channel`; returns its payload, to be encoded into. `sent`: see Entry.
  std::vector<std::uint8_t>& add(std::string_view channel, bool sent = false) {
    if (used_ == entries_.size()) entries_.emplace_back();
    Entry& entry = entries_[used_++];
    entry.channel.assign(channel);
    entry.sent = sent;
    return entry.payload;
  }
  void add_frame(Frame frame) { frames_.push_back(std::move(frame)); }

  std::span<Entry> entries() { return {entries_.data(), used_}; }
  std::span<const Entry> entries() const { return {entries_.data(), used_}; }
  std::vector<Frame>& frames() { return frames_; }

 private:
  std::vector<Entry> entries_;
  std::size_t used_ = 0;
  std::vector<Frame> frames_;
};

}  // namespace parhelion::tick

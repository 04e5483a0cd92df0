// What one tick gives: messages in order, jobs for the render thread, and stage marks for whoever measures.
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

/// Stages of a tick, in the order in which they end. `encode` is that of MR_SCAN.
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

/// Told how far a tick is. The tick itself reads no clock and sends nothing.
class StageObserver {
 public:
  virtual ~StageObserver() = default;
  virtual void ended(Stage) {}
  /// MR_SCAN of the input is whole, and what the server learns from the scan for itself comes after: a robot
  /// need not wait for that. The same bytes are among the outputs.
  virtual void answered(std::span<const std::uint8_t>) {}
};

/// Reused from tick to tick, so that warm messages keep their capacity.
class Outputs {
 public:
  struct Entry {
    std::string channel;  ///< name on the bus
    std::vector<std::uint8_t> payload;
  };
  /// An image that waits for the render thread, with what it looked like when it came.
  struct Frame {
    render::RenderJob job;
    std::uint64_t sequence = 0;                  ///< of camera frames
    std::shared_ptr<const SemanticModel> model;  ///< the building; null: the one that the session began with
    std::string reason;  ///< why nothing is to be drawn: the original goes out, in its turn
    /// Of a simulated robot's camera: there is no image yet, the whole picture is rendered.
    std::optional<render::Exposure> exposure;
    std::string agent;  ///< whose camera it is; empty: the trainee's robot's
  };

  void clear() {
    used_ = 0;
    frames_.clear();
  }
  /// The payload of a new message on `channel`, to be encoded into.
  std::vector<std::uint8_t>& add(std::string_view channel) {
    if (used_ == entries_.size()) entries_.emplace_back();
    Entry& entry = entries_[used_++];
    entry.channel.assign(channel);
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

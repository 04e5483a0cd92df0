// Distinguishes the server's own messages, which the bus returns, from messages of other publishers on the
// same channels.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/tick/configuration.hpp"

namespace parhelion::runtime {

/// Remembers hashes of the newest few thousand messages: some seconds of all sensors. Thread-safe.
class SentMessages {
 public:
  /// Watches the channels of tick::own_channels() that are outputs of this session, and
  /// tick::further_laser_outputs().
  explicit SentMessages(const tick::Configuration& configuration);

  const std::vector<std::string>& channels() const { return channels_; }  ///< names on the bus
  /// Call before publishing; other channels are ignored.
  void add(std::string_view channel, std::span<const std::uint8_t> payload);
  /// A message of another publisher: the index of its channel as in tick::report_foreign_message(). nullopt:
  /// our own message, or another channel.
  std::optional<std::int64_t> foreign(std::string_view channel, std::span<const std::uint8_t> payload) const;

 private:
  std::optional<std::size_t> find(std::string_view channel) const;

  std::vector<std::string> channels_;
  std::vector<std::int64_t> indices_;  // parallel to channels_
  mutable std::mutex mutex_;
  std::array<std::uint64_t, 4096> ring_{};
  std::size_t next_ = 0;
};

}  // namespace parhelion::runtime

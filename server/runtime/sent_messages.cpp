#include "server/runtime/sent_messages.hpp"

#include <algorithm>

#include "protocols/channel_map.hpp"
#include "protocols/hash.hpp"
#include "server/tick/foreign_publisher.hpp"

namespace parhelion::runtime {
namespace {

std::uint64_t hash_of(std::string_view channel, std::span<const std::uint8_t> payload) {
  return fnv1a_of_blocks(payload, fnv1a(channel));
}

}  // namespace

SentMessages::SentMessages(const tick::Configuration& configuration) {
  const std::vector<std::string>& names = tick::own_channels();
  const auto first_of_all_levels = static_cast<std::size_t>(tick::status_channel_index());
  const std::size_t first = tick::simulates_trainee(configuration.scenario) ? 0 : first_of_all_levels;
  for (std::size_t k = 0; k < configuration.robot_count() * names.size(); ++k) {
    const std::size_t robot = k / names.size(), i = k % names.size();
    if (i < first || (robot > 0 && !is_robot_channel(names[i]))) continue;
    const std::string bus = configuration.channels.bus(names[i], robot);
    // POSE_COV is an input if SLAM provides it.
    if (configuration.channels.kind(bus) != tick::InputKind::none) continue;
    channels_.push_back(bus);
    indices_.push_back(static_cast<std::int64_t>(k));
  }
  auto index = static_cast<std::int64_t>(configuration.robot_count() * names.size());
  for (tick::LaserOutput& own : tick::further_laser_outputs(configuration)) {
    channels_.push_back(std::move(own.bus));
    indices_.push_back(index++);
  }
}

std::optional<std::size_t> SentMessages::find(std::string_view channel) const {
  const auto at = std::find(channels_.begin(), channels_.end(), channel);
  if (at == channels_.end()) return std::nullopt;
  return static_cast<std::size_t>(at - channels_.begin());
}

void SentMessages::add(std::string_view channel, std::span<const std::uint8_t> payload) {
  if (!find(channel)) return;
  const std::uint64_t hash = hash_of(channel, payload);
  const std::lock_guard lock(mutex_);
  ring_[next_++ % ring_.size()] = hash;
}

std::optional<std::int64_t> SentMessages::foreign(std::string_view channel,
                                                  std::span<const std::uint8_t> payload) const {
  const auto found = find(channel);
  if (!found) return std::nullopt;
  const std::uint64_t hash = hash_of(channel, payload);
  const std::lock_guard lock(mutex_);
  if (std::find(ring_.begin(), ring_.end(), hash) != ring_.end()) return std::nullopt;
  return indices_[*found];
}

}  // namespace parhelion::runtime

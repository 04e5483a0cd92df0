#include "protocols/bus/reassembly.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::uint32_t kShort = 0x4c433032, kLong = 0x4c433033;  // "LC02", "LC03"
constexpr std::size_t kShortHeader = 8, kLongHeader = 20;
constexpr std::size_t kMaxChannel = 63;

/// The channel at the start of `bytes`, which ends with a zero; empty: none.
std::string_view leading_channel(std::span<const std::uint8_t> bytes) {
  const std::size_t searched = std::min(bytes.size(), kMaxChannel + 1);
  const void* end = searched == 0 ? nullptr : std::memchr(bytes.data(), 0, searched);
  if (end == nullptr) return {};
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  return {text, static_cast<std::size_t>(static_cast<const char*>(end) - text)};
}

}  // namespace

const char* to_string(DatagramFault fault) {
  switch (fault) {
    case DatagramFault::truncated:
      return "truncated";
    case DatagramFault::not_lcm:
      return "not LCM";
    case DatagramFault::bad_channel:
      return "bad channel";
    case DatagramFault::too_large:
      return "too large";
    case DatagramFault::inconsistent:
      return "inconsistent";
    case DatagramFault::repeated:
      return "repeated";
    case DatagramFault::overlapping:
      return "overlapping";
    case DatagramFault::incomplete:
      return "incomplete";
  }
  return "unknown";
}

struct Reassembly::Fragment {
  std::uint32_t sequence, message_size, offset;
  std::uint16_t number, count;
  std::span<const std::uint8_t> data;

  explicit Fragment(std::span<const std::uint8_t> datagram)
      : sequence(wire::big_endian<std::uint32_t>(datagram.data() + 4)),
        message_size(wire::big_endian<std::uint32_t>(datagram.data() + 8)),
        offset(wire::big_endian<std::uint32_t>(datagram.data() + 12)),
        number(wire::big_endian<std::uint16_t>(datagram.data() + 16)),
        count(wire::big_endian<std::uint16_t>(datagram.data() + 18)),
        data(datagram.subspan(kLongHeader)) {}
  /// Whether it lies within its message. Only a message of one fragment may be empty.
  bool sane() const {
    if (number >= count || (data.empty() && message_size > 0)) return false;
    if (count > 1 && message_size < count) return false;
    return std::uint64_t{offset} + data.size() <= message_size;
  }
};

std::size_t Reassembly::Pending::bytes() const {
  return sizeof(Pending) + data.capacity() + pieces.capacity() * sizeof(Piece) + seen.capacity() / 8;
}

Reassembly::Reassembly(MaxPayload max_payload, const ReassemblyLimits& limits)
    : max_payload_(std::move(max_payload)), limits_(limits) {}

std::optional<Reassembly::Complete> Reassembly::add(const DatagramSender& sender,
                                                    std::span<const std::uint8_t> datagram,
                                                    ArrivalTime arrival) {
  drop_old(arrival);
  if (datagram.size() < kShortHeader) {
    count(DatagramFault::truncated);
    return std::nullopt;
  }
  switch (wire::big_endian<std::uint32_t>(datagram.data())) {
    case kShort:
      return add_short(datagram);
    case kLong:
      return add_fragment(sender, datagram, arrival);
    default:
      count(DatagramFault::not_lcm);
      return std::nullopt;
  }
}

std::optional<Reassembly::Complete> Reassembly::add_short(std::span<const std::uint8_t> datagram) {
  const auto body = datagram.subspan(kShortHeader);
  const std::string_view channel = leading_channel(body);
  if (channel.empty()) {
    count(DatagramFault::bad_channel);
    return std::nullopt;
  }
  const auto payload = body.subspan(channel.size() + 1);
  const std::size_t max = max_payload_(channel);
  if (max == 0) return std::nullopt;
  if (payload.size() > max) {
    count(DatagramFault::too_large);
    return std::nullopt;
  }
  return Complete{channel, payload};
}

std::optional<Reassembly::Complete> Reassembly::add_fragment(const DatagramSender& sender,
                                                             std::span<const std::uint8_t> datagram,
                                                             ArrivalTime arrival) {
  if (datagram.size() < kLongHeader) {
    count(DatagramFault::truncated);
    return std::nullopt;
  }
  Fragment fragment(datagram);
  std::string_view channel;
  if (fragment.number == 0) {
    channel = leading_channel(fragment.data);
    if (channel.empty()) {
      count(DatagramFault::bad_channel);
      return std::nullopt;
    }
    fragment.data = fragment.data.subspan(channel.size() + 1);
  }
  if (!fragment.sane()) {
    count(DatagramFault::inconsistent);
    return std::nullopt;
  }
  const auto pending = find(sender, fragment, arrival);
  if (pending->seen[fragment.number]) {
    count(DatagramFault::repeated);
    return std::nullopt;
  }
  const std::size_t before = pending->bytes();
  pending->newest = arrival;
  pending->seen[fragment.number] = true;
  ++pending->received;
  if (fragment.number == 0) {
    const std::size_t max = max_payload_(channel);
    if (max != 0 && fragment.message_size > max) count(DatagramFault::too_large);
    pending->ignored = fragment.message_size > max || max == 0;
    pending->channel.assign(channel);
    if (pending->ignored) pending->data = {}, pending->pieces = {};
  }
  if (!pending->ignored) {
    pending->pieces.push_back({fragment.offset, static_cast<std::uint32_t>(pending->data.size()),
                               static_cast<std::uint32_t>(fragment.data.size())});
    std::vector<std::uint8_t>& data = pending->data;
    // At most what the message declares, and at most twice what has come.
    const std::size_t needed = data.size() + fragment.data.size();
    if (needed > data.capacity())
      data.reserve(std::max(needed, std::min<std::size_t>(2 * data.capacity(), pending->size)));
    data.insert(data.end(), fragment.data.begin(), fragment.data.end());
    if (data.size() > pending->size) {
      count(DatagramFault::overlapping);
      bytes_ -= before;
      pending_.erase(pending);
      return std::nullopt;
    }
  }
  bytes_ += pending->bytes() - before;
  if (pending->received == pending->fragments) return finish(pending);
  make_room(sender);
  return std::nullopt;
}

/// The message that the fragment belongs to, which may be a new one. A sender that started again uses its
/// sequence numbers again: the newer message replaces the older one.
Reassembly::PendingList::iterator Reassembly::find(const DatagramSender& sender, const Fragment& fragment,
                                                   ArrivalTime arrival) {
  const auto found = std::find_if(pending_.begin(), pending_.end(), [&](const Pending& each) {
    return each.sender == sender && each.sequence == fragment.sequence;
  });
  if (found != pending_.end()) {
    if (found->size == fragment.message_size && found->fragments == fragment.count) return found;
    count(DatagramFault::incomplete);
    erase(found);
  }
  Pending& added = pending_.emplace_back();
  added.sender = sender;
  added.sequence = fragment.sequence;
  added.size = fragment.message_size;
  added.fragments = fragment.count;
  added.newest = arrival;
  added.seen.resize(fragment.count);
  bytes_ += added.bytes();
  return std::prev(pending_.end());
}

std::optional<Reassembly::Complete> Reassembly::finish(PendingList::iterator pending) {
  if (pending->ignored) {
    erase(pending);
    return std::nullopt;
  }
  std::vector<Piece>& pieces = pending->pieces;
  const auto by_offset = [](const Piece& a, const Piece& b) { return a.offset < b.offset; };
  const bool in_order = std::is_sorted(pieces.begin(), pieces.end(), by_offset);
  if (!in_order) std::sort(pieces.begin(), pieces.end(), by_offset);
  std::uint64_t end = 0;
  for (const Piece& piece : pieces) {
    if (piece.offset != end) break;
    end += piece.size;
  }
  if (end != pending->size || pending->data.size() != pending->size) {
    count(DatagramFault::overlapping);
    erase(pending);
    return std::nullopt;
  }
  channel_ = std::move(pending->channel);
  const std::size_t bytes = pending->bytes();
  if (in_order) {
    payload_ = std::move(pending->data);
  } else {
    payload_.clear();
    payload_.reserve(pending->size);
    for (const Piece& piece : pieces) {
      const auto begin = pending->data.begin() + piece.begin;
      payload_.insert(payload_.end(), begin, begin + piece.size);
    }
  }
  bytes_ -= bytes;
  pending_.erase(pending);
  return Complete{channel_, payload_};
}

void Reassembly::erase(PendingList::iterator pending) {
  bytes_ -= pending->bytes();
  pending_.erase(pending);
}

void Reassembly::drop_old(ArrivalTime now) {
  for (auto each = pending_.begin(); each != pending_.end();) {
    const auto old = each++;
    if (now - old->newest <= limits_.age) continue;
    if (!old->ignored) count(DatagramFault::incomplete);
    erase(old);
  }
}

/// Drops the oldest message of the sender that takes the most memory, so that a flood of one sender costs
/// that sender its own messages.
void Reassembly::make_room(const DatagramSender&) {
  while (bytes_ > limits_.bytes || pending_.size() > limits_.messages) {
    std::vector<std::pair<DatagramSender, std::size_t>> senders;
    for (const Pending& each : pending_) {
      auto sum = std::find_if(senders.begin(), senders.end(),
                              [&](const auto& sender) { return sender.first == each.sender; });
      if (sum == senders.end()) sum = senders.insert(sum, {each.sender, 0});
      sum->second += each.bytes() + limits_.bytes / limits_.messages;
    }
    const auto greediest = std::max_element(senders.begin(), senders.end(),
                                            [](const auto& a, const auto& b) { return a.second < b.second; });
    const auto oldest = std::find_if(pending_.begin(), pending_.end(),
                                     [&](const Pending& each) { return each.sender == greediest->first; });
    if (!oldest->ignored) count(DatagramFault::incomplete);
    erase(oldest);
  }
}

}  // namespace parhelion

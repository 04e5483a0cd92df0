// Sequences of UDP datagrams to the reassembly of LCM messages. Input: each datagram after its length (two
// bytes) and a byte for sender and time.
#include <cstdint>
#include <cstdlib>
#include <span>

#include "protocols/bus/reassembly.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace parhelion;
  constexpr ReassemblyLimits limits{std::size_t{1} << 18, 8, seconds(1.0)};
  Reassembly reassembly(
      [](std::string_view channel) {
        return channel.starts_with("U")   ? std::size_t{0}
               : channel.starts_with("T") ? std::size_t{64}
                                          : std::size_t{1} << 17;
      },
      limits);
  std::span<const std::uint8_t> rest(data, size);
  ArrivalTime now{1'000'000'000};
  std::uint64_t sum = 0;
  while (rest.size() >= 3) {
    const std::size_t length = std::min<std::size_t>(rest[0] * std::size_t{256} + rest[1], rest.size() - 3);
    const DatagramSender sender{1, static_cast<std::uint16_t>(rest[2] & 3U)};
    now = now + milliseconds(rest[2] >> 2U);
    const auto complete = reassembly.add(sender, rest.subspan(3, length), now);
    if (complete) {
      // Reads each byte, for the sanitizers.
      for (const std::uint8_t byte : complete->payload) sum += byte;
      if (complete->channel.empty() || complete->channel.size() > 63) std::abort();
    }
    if (reassembly.pending_bytes() > limits.bytes || reassembly.pending_messages() > limits.messages)
      std::abort();
    rest = rest.subspan(3 + length);
  }
  volatile std::uint64_t used = sum;
  static_cast<void>(used);
  return 0;
}

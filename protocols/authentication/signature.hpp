// Signatures of messages: a trailer after the payload, which LCM's decoders ignore. Sender, counter and time
// are as in MAVLink 2 (https://mavlink.io/en/guide/message_signing.html), the window of counters as in IPsec
// (RFC 4303, section 3.4.3).
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "protocols/authentication/keys.hpp"
#include "protocols/authentication/signature_fault.hpp"
#include "protocols/bus/channel_pattern.hpp"
#include "protocols/time.hpp"

namespace parhelion {

/// The trailer, numbers big-endian as in LCM: sender (8 bytes: the name's BLAKE2b-64), run (16 random bytes
/// of the sender's start), counter (8; from 1), time (8; microseconds since 1970), tag (16), "PHS1". The tag
/// is that of XChaCha20-Poly1305 (draft-irtf-cfrg-xchacha-03) over payload, sender, run, counter and time;
/// its nonce is run and counter, its key the BLAKE2b-256 of the channel's name under the sender's secret.
inline constexpr std::size_t kSignatureSize = 60;

/// Whether the bytes have the size and the mark of a trailer; nothing is verified.
bool looks_signed(std::span<const std::uint8_t> trailer);

/// False for sensor data, of which each message counts, in whatever order they arrive. All others, commands
/// among them, must be published and are accepted in the order in which they were signed.
bool must_be_in_order(std::string_view channel);

/// A secret with the keys that it gives for each channel.
class ChannelKeys {
 public:
  explicit ChannelKeys(const Secret& secret) : secret_(secret) {}
  const Secret& of(std::string_view channel);

 private:
  static constexpr std::size_t kMaxKept = 256;
  Secret secret_;
  std::unordered_map<std::string, Secret> keys_;
};

/// Thread-safe.
class Signer {
 public:
  Signer(const std::string& name, const Secret& secret);
  /// `signed_message`: the payload with its trailer; its capacity is reused. `now`: since 1970.
  void sign(std::string_view channel, std::span<const std::uint8_t> payload, SensorTime now,
            std::vector<std::uint8_t>& signed_message);

 private:
  std::mutex mutex_;
  ChannelKeys keys_;
  const std::uint64_t sender_;
  std::array<std::uint8_t, 16> run_{};
  std::uint64_t counter_ = 0;
};

/// Call in one thread.
class Verifier {
 public:
  /// Accepts the senders of `keys`, and the program itself on each channel. Messages from before `start` are
  /// refused: an earlier run of the program, whose counters are gone, may have accepted them. Where
  /// messages must be in order, one that a newer one of its run and channel has overtaken is refused: a
  /// command that was lost here, and that somebody else kept, must not follow a stop.
  explicit Verifier(const Keys& keys, SensorTime start = {});

  struct Verdict {
    std::optional<SignatureFault> fault;  ///< none: the message is what its sender sent
    std::string_view sender;              ///< as the message says; empty: unknown
  };
  /// `message`: payload and trailer. `now`: since 1970. Remembers the counters of accepted messages.
  Verdict verify(std::string_view channel, std::span<const std::uint8_t> message, SensorTime now);

 private:
  static constexpr std::uint64_t kWindow = 1024;  // counters
  static constexpr std::size_t kMaxRuns = 64;     // of one sender within Keys::clock
  using RunId = std::array<std::uint8_t, 16>;

  struct Run {
    std::uint64_t newest = 0;       ///< counter
    std::bitset<kWindow> received;  ///< by counter modulo kWindow
    SensorTime last;                ///< sender's time of the newest message
    std::map<std::string, std::uint64_t, std::less<>>
        newest_of;  ///< counter, by channel that must be in order
    bool add(std::string_view channel, std::uint64_t counter);
  };
  struct KnownSender {
    std::string name;
    ChannelKeys keys;
    std::vector<ChannelPattern> channels;
    std::map<RunId, Run> runs;
  };
  Run* run_of(KnownSender& sender, const RunId& id, SensorTime now) const;

  const Duration clock_;
  const SensorTime start_;
  std::unordered_map<std::uint64_t, KnownSender> senders_;
};

}  // namespace parhelion

#include "protocols/authentication/signature.hpp"

#include <sodium.h>

#include <algorithm>
#include <cstdlib>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {

using wire::big_endian;

namespace {

// Offsets in the trailer.
constexpr std::size_t kRun = 8, kCounter = 24, kTime = 32, kTag = 40, kMark = 56;
constexpr std::array<std::uint8_t, 4> kMarkBytes{'P', 'H', 'S', '1'};
using Nonce = std::array<std::uint8_t, crypto_aead_xchacha20poly1305_ietf_NPUBBYTES>;
static_assert(crypto_aead_xchacha20poly1305_ietf_NPUBBYTES == kTime - kRun);
static_assert(crypto_aead_xchacha20poly1305_ietf_KEYBYTES == std::tuple_size_v<Secret>);
static_assert(crypto_aead_xchacha20poly1305_ietf_ABYTES == kMark - kTag);

void start_sodium() {
  if (sodium_init() < 0) std::abort();  // without random numbers nothing is secret
}

std::uint64_t id_of(std::string_view name) {
  std::array<std::uint8_t, 16> hash;  // libsodium's shortest
  crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const std::uint8_t*>(name.data()),
                     name.size(), nullptr, 0);
  return big_endian<std::uint64_t>(hash.data());
}

Nonce nonce_of(const std::uint8_t* trailer) {
  Nonce nonce;
  std::copy(trailer + kRun, trailer + kTime, nonce.begin());
  return nonce;
}

std::vector<ChannelPattern> patterns_of(const Sender& sender) {
  std::vector<std::string> texts = sender.channels;
  for (const std::string& role : sender.roles) {
    for (const std::string& channel : channels_of_role(role).value_or(std::vector<std::string>())) {
      texts.push_back(channel);
      if (is_robot_channel(channel)) texts.push_back(channel + "\\..+");  // of each of several robots
      if (std::string each = sensor_channel_pattern(channel); !each.empty()) texts.push_back(std::move(each));
    }
  }
  std::vector<ChannelPattern> patterns;
  for (const std::string& text : texts) {
    if (auto made = make_pattern(text)) patterns.push_back(std::move(*made));
  }
  // Plain names are compared faster.
  std::stable_partition(patterns.begin(), patterns.end(),
                        [](const ChannelPattern& pattern) { return !pattern.expression; });
  return patterns;
}

}  // namespace

bool looks_signed(std::span<const std::uint8_t> trailer) {
  return trailer.size() == kSignatureSize &&
         std::equal(kMarkBytes.begin(), kMarkBytes.end(), trailer.begin() + kMark);
}

bool must_be_in_order(std::string_view channel) {
  using namespace channel;
  static const std::vector<std::string> any_order = [] {
    std::vector<std::string> names = *channels_of_role("robot");
    for (const char* name : {kPoseCov, kPose, kMrScan, kMrScanInfo, kMrCamera, kMrDepth, kMrEvents})
      names.emplace_back(name);
    return names;
  }();
  const auto parts = parse_robot_channel(channel);
  if (!parts) return true;
  const std::string_view of_first = parse_sensor_channel(parts->canonical).canonical;
  return std::find(any_order.begin(), any_order.end(), of_first) == any_order.end();
}

const char* to_string(SignatureFault fault) {
  switch (fault) {
    case SignatureFault::not_signed:
      return "not signed";
    case SignatureFault::unknown_sender:
      return "signed by an unknown sender";
    case SignatureFault::wrong_channel:
      return "signed by a sender that may not publish there";
    case SignatureFault::bad_signature:
      return "signed with another secret, or changed on the way";
    case SignatureFault::wrong_time:
      return "signed too long ago, or with another clock";
    case SignatureFault::replayed:
      return "received before, or overtaken by a newer one";
    case SignatureFault::too_many_runs:
      return "signed by a sender that starts too often";
  }
  return "";
}

const Secret& ChannelKeys::of(std::string_view channel) {
  const std::string name(channel);
  const auto known = keys_.find(name);
  if (known != keys_.end()) return known->second;
  if (keys_.size() >= kMaxKept) keys_.clear();
  Secret& key = keys_[name];
  crypto_generichash(key.data(), key.size(), reinterpret_cast<const std::uint8_t*>(channel.data()),
                     channel.size(), secret_.data(), secret_.size());
  return key;
}

Signer::Signer(const std::string& name, const Secret& secret) : keys_(secret), sender_(id_of(name)) {
  start_sodium();
  randombytes_buf(run_.data(), run_.size());
}

void Signer::sign(std::string_view channel, std::span<const std::uint8_t> payload, SensorTime now,
                  std::vector<std::uint8_t>& signed_message) {
  signed_message.resize(payload.size() + kSignatureSize);
  std::copy(payload.begin(), payload.end(), signed_message.begin());
  std::uint8_t* const trailer = signed_message.data() + payload.size();
  big_endian(sender_, trailer);
  std::copy(run_.begin(), run_.end(), trailer + kRun);
  std::copy(kMarkBytes.begin(), kMarkBytes.end(), trailer + kMark);
  big_endian(now.utime(), trailer + kTime);
  const std::lock_guard lock(mutex_);
  big_endian(++counter_, trailer + kCounter);
  std::uint8_t nothing = 0;  // is encrypted
  crypto_aead_xchacha20poly1305_ietf_encrypt_detached(&nothing, trailer + kTag, nullptr, nullptr, 0,
                                                      signed_message.data(), payload.size() + kTag, nullptr,
                                                      nonce_of(trailer).data(), keys_.of(channel).data());
}

Verifier::Verifier(const Keys& keys, SensorTime start) : clock_(keys.clock), start_(start) {
  start_sodium();
  for (const Sender& sender : keys.senders)
    senders_.emplace(id_of(sender.name),
                     KnownSender{sender.name, ChannelKeys(sender.secret), patterns_of(sender), {}});
  senders_.emplace(
      id_of(keys.name),
      KnownSender{keys.name, ChannelKeys(keys.secret), {ChannelPattern{".*", std::regex(".*")}}, {}});
}

Verifier::Verdict Verifier::verify(std::string_view channel, std::span<const std::uint8_t> message,
                                   SensorTime now) {
  using enum SignatureFault;
  if (message.size() < kSignatureSize || !looks_signed(message.last(kSignatureSize))) return {not_signed, {}};
  const std::uint8_t* const trailer = message.data() + message.size() - kSignatureSize;
  const auto known = senders_.find(big_endian<std::uint64_t>(trailer));
  if (known == senders_.end()) return {unknown_sender, {}};
  KnownSender& sender = known->second;
  const auto permits = [&](const ChannelPattern& pattern) { return pattern.matches(channel); };
  if (std::none_of(sender.channels.begin(), sender.channels.end(), permits))
    return {wrong_channel, sender.name};
  std::uint8_t nothing = 0;  // was encrypted
  if (crypto_aead_xchacha20poly1305_ietf_decrypt_detached(
          &nothing, nullptr, &nothing, 0, trailer + kTag, message.data(),
          message.size() - kSignatureSize + kTag, nonce_of(trailer).data(),
          sender.keys.of(channel).data()) != 0) {
    return {bad_signature, sender.name};
  }
  const auto utime = big_endian<std::int64_t>(trailer + kTime);
  const SensorTime oldest = std::max(now - clock_, start_);
  if (utime < oldest.utime() || utime > (now + clock_).utime()) return {wrong_time, sender.name};
  RunId id;
  std::copy(trailer + kRun, trailer + kCounter, id.begin());
  Run* const run = run_of(sender, id, now);
  if (run == nullptr) return {too_many_runs, sender.name};
  if (!run->add(channel, big_endian<std::uint64_t>(trailer + kCounter))) return {replayed, sender.name};
  run->last = std::max(run->last, SensorTime::from_utime(utime));
  return {std::nullopt, sender.name};
}

/// Runs whose messages are all too old to be accepted again are forgotten. nullptr: there are too many.
Verifier::Run* Verifier::run_of(KnownSender& sender, const RunId& id, SensorTime now) const {
  const auto known = sender.runs.find(id);
  if (known != sender.runs.end()) return &known->second;
  std::erase_if(sender.runs, [&](const auto& each) { return each.second.last < now - clock_; });
  if (sender.runs.size() >= kMaxRuns) return nullptr;
  return &sender.runs[id];
}

/// False: received before, older than the window, or overtaken.
bool Verifier::Run::add(std::string_view channel, std::uint64_t counter) {
  if (counter + kWindow <= newest) return false;
  if (must_be_in_order(channel)) {
    const auto known = newest_of.find(channel);
    if (known == newest_of.end()) {
      newest_of.emplace(channel, counter);
    } else if (counter <= known->second) {
      return false;
    } else {
      known->second = counter;
    }
  }
  if (counter > newest) {
    for (std::uint64_t skipped = newest + 1; skipped < counter && skipped <= newest + kWindow; ++skipped)
      received.reset(skipped % kWindow);
    newest = counter;
  } else if (received.test(counter % kWindow)) {
    return false;
  }
  received.set(counter % kWindow);
  return true;
}

}  // namespace parhelion

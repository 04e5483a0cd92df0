// Signs messages for a server with authentication (docs/security.md), with libsodium.
#pragma once

#include <sodium.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

/// The sender of a file that `parhelion key new` wrote. One for each run of a program.
class Signer {
 public:
  /// Throws where the file has no name or no secret.
  explicit Signer(const std::string& keys) {
    std::ifstream file(keys);
    std::string name, secret;
    // The file's own name and secret are those that are not indented.
    for (std::string line; std::getline(file, line);) {
      if (line.rfind("name: ", 0) == 0) name = value_of(line);
      if (line.rfind("secret: ", 0) == 0) secret = value_of(line);
    }
    std::size_t size = 0;
    const int read = sodium_base642bin(secret_.data(), secret_.size(), secret.data(), secret.size(), nullptr,
                                       &size, nullptr, sodium_base64_VARIANT_ORIGINAL);
    if (sodium_init() < 0 || name.empty() || read != 0 || size != secret_.size())
      throw std::runtime_error(keys + ": expected a file of `parhelion key new`");
    std::array<std::uint8_t, 16> hash;
    crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const std::uint8_t*>(name.data()),
                       name.size(), nullptr, 0);
    sender_.assign(hash.begin(), hash.begin() + 8);
    randombytes_buf(run_.data(), run_.size());
  }

  /// Appends the trailer of the signature to `message`.
  void sign(const std::string& channel, std::vector<std::uint8_t>& message) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    std::vector<std::uint8_t> nonce = run_;
    append(nonce, ++counter_);
    message.insert(message.end(), sender_.begin(), sender_.end());
    message.insert(message.end(), nonce.begin(), nonce.end());
    append(message, std::chrono::duration_cast<std::chrono::microseconds>(now).count());
    std::array<std::uint8_t, 32> key;
    crypto_generichash(key.data(), key.size(), reinterpret_cast<const std::uint8_t*>(channel.data()),
                       channel.size(), secret_.data(), secret_.size());
    std::array<std::uint8_t, 16> tag;
    std::uint8_t nothing = 0;  // is encrypted
    crypto_aead_xchacha20poly1305_ietf_encrypt_detached(&nothing, tag.data(), nullptr, nullptr, 0,
                                                        message.data(), message.size(), nullptr, nonce.data(),
                                                        key.data());
    message.insert(message.end(), tag.begin(), tag.end());
    for (const char c : {'P', 'H', 'S', '1'}) message.push_back(static_cast<std::uint8_t>(c));
  }

 private:
  static std::string value_of(const std::string& line) {
    std::string value = line.substr(line.find(": ") + 2);
    if (value.size() >= 2 && value.front() == '"') value = value.substr(1, value.size() - 2);
    return value;
  }
  /// Big-endian.
  static void append(std::vector<std::uint8_t>& bytes, std::uint64_t number) {
    for (int shift = 56; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(number >> shift));
  }

  std::array<std::uint8_t, 32> secret_{};
  std::vector<std::uint8_t> sender_, run_ = std::vector<std::uint8_t>(16);
  std::uint64_t counter_ = 0;
};

/// Publishes; signs if the environment names a file of keys.
class Publisher {
 public:
  explicit Publisher(lcm::LCM& lcm) : lcm_(lcm) {
    if (const char* keys = std::getenv("PARHELION_KEYS")) signer_.emplace(keys);
  }

  template <class Type>
  void publish(const std::string& channel, const Type& message) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    if (signer_) signer_->sign(channel, bytes);
    lcm_.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size()));
  }

 private:
  lcm::LCM& lcm_;
  std::optional<Signer> signer_;
};

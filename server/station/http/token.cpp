#include "server/station/http/token.hpp"

#include <openssl/rand.h>

#include <array>
#include <cstdlib>
#include <span>

#include "protocols/sha256.hpp"

namespace parhelion::station {

std::string random_token() {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::array<unsigned char, 43> bytes{};  // 6 bits of each
  // Without randomness there are no secrets. OpenSSL fails here only if the machine has no entropy source.
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) std::abort();
  std::string token;
  for (const unsigned char byte : bytes) token += alphabet[byte % 64];
  return token;
}

std::string token_digest(std::string_view token) {
  Sha256 digest;
  digest.add({reinterpret_cast<const std::uint8_t*>(token.data()), token.size()});
  return digest.hex();
}

}  // namespace parhelion::station

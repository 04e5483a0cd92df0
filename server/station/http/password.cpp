#include "server/station/http/password.hpp"

#include <argon2.h>
#include <openssl/rand.h>

#include <array>

namespace parhelion::station {
namespace {

// OWASP's password storage recommendation for argon2id.
constexpr std::uint32_t kPasses = 2, kMemoryKib = 19 * 1024, kLanes = 1;
constexpr std::size_t kSaltBytes = 16, kHashBytes = 32;

}  // namespace

Status check_password(const std::string& password) {
  if (password.size() < 8) return Error{"a password has at least 8 characters"};
  if (password.size() > 200) return Error{"a password has at most 200 characters"};
  return {};
}

Result<std::string> hash_password(const std::string& password) {
  std::array<unsigned char, kSaltBytes> salt{};
  if (RAND_bytes(salt.data(), static_cast<int>(salt.size())) != 1)
    return Error{"no random numbers for a salt"};
  std::string encoded(argon2_encodedlen(kPasses, kMemoryKib, kLanes, kSaltBytes, kHashBytes, Argon2_id),
                      '\0');
  const int failed =
      argon2id_hash_encoded(kPasses, kMemoryKib, kLanes, password.data(), password.size(), salt.data(),
                            salt.size(), kHashBytes, encoded.data(), encoded.size());
  if (failed != ARGON2_OK) return Error{std::string("argon2: ") + argon2_error_message(failed)};
  encoded.resize(encoded.find('\0'));
  return encoded;
}

bool password_matches(const std::string& hash, const std::string& password) {
  return argon2id_verify(hash.c_str(), password.data(), password.size()) == ARGON2_OK;
}

}  // namespace parhelion::station

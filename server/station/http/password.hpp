// Passwords, hashed with argon2id (RFC 9106): 19 MiB and two passes, about 30 ms of a core each time.
#pragma once

#include <string>

#include "protocols/status.hpp"

namespace parhelion::station {

/// Error: shorter than 8 or longer than 200 bytes.
Status check_password(const std::string& password);

/// "$argon2id$v=19$m=...": includes salt and parameters. Slow on purpose. Error: no memory.
Result<std::string> hash_password(const std::string& password);

/// Takes the same time for right and wrong passwords. Also false if `hash` is not a hash.
bool password_matches(const std::string& hash, const std::string& password);

}  // namespace parhelion::station

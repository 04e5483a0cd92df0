// Passwords, kept as argon2id (RFC 9106) says: 19 MiB and two passes, about 30 ms of a core each time.
#pragma once

#include <string>

#include "protocols/status.hpp"

namespace parhelion::station {

/// Error: shorter than 8 or longer than 200 bytes.
Status check_password(const std::string& password);

/// "$argon2id$v=19$m=...": salt and parameters included. Takes long on purpose. Error: no memory.
Result<std::string> hash_password(const std::string& password);

/// Takes as long, right or wrong. False also where `hash` is none.
bool password_matches(const std::string& hash, const std::string& password);

}  // namespace parhelion::station

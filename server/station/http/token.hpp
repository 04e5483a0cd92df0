// Secrets that a person or a browser carries.
#pragma once

#include <string>
#include <string_view>

namespace parhelion::station {

/// 256 random bits, in letters, digits, '-' and '_'.
std::string random_token();

/// What is kept of a token, so that comparing says nothing about it: SHA-256, lower-case hex.
std::string token_digest(std::string_view token);

}  // namespace parhelion::station

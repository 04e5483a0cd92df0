// Random secret tokens for people and browsers.
#pragma once

#include <string>
#include <string_view>

namespace parhelion::station {

/// 256 random bits, in letters, digits, '-' and '_'.
std::string random_token();

/// Stored in place of a token, so that comparison leaks nothing about it: SHA-256, lower-case hex.
std::string token_digest(std::string_view token);

}  // namespace parhelion::station

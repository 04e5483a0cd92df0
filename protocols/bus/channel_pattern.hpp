// What a subscription matches: a channel, or a regular expression as in LCM.
#pragma once

#include <optional>
#include <regex>
#include <string>
#include <string_view>

#include "protocols/status.hpp"

namespace parhelion {

struct ChannelPattern {
  std::string text;
  std::optional<std::regex> expression;  ///< absent: `text` is a plain channel name

  bool matches(std::string_view channel) const {
    return expression ? std::regex_match(channel.begin(), channel.end(), *expression) : text == channel;
  }
};

inline Result<ChannelPattern> make_pattern(const std::string& text) {
  if (text.find_first_of(".*+?()[]{}|^$\\") == std::string::npos) return ChannelPattern{text, {}};
  try {
    return ChannelPattern{text, std::regex(text)};
  } catch (const std::regex_error& error) {
    return Error{"subscribe to '" + text + "': not a regular expression: " + error.what()};
  }
}

}  // namespace parhelion

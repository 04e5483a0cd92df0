// Error texts for unreadable JSON.
#pragma once

#include <cstring>
#include <exception>
#include <string>

namespace parhelion::training {

/// The library's message without its leading number.
inline std::string json_reason(const std::exception& error) {
  const char* text = std::strstr(error.what(), "] ");
  return text == nullptr ? error.what() : text + 2;
}

}  // namespace parhelion::training

// Which of its two forms a test takes that has a long one.
#pragma once

#include <cstdlib>
#include <string_view>

namespace parhelion::test {

/// PARHELION_LONG=1, as `tools/test --long` sets it; any other value is the short form.
inline bool long_run() {
  const char* chosen = std::getenv("PARHELION_LONG");
  return chosen != nullptr && std::string_view(chosen) == "1";
}

}  // namespace parhelion::test

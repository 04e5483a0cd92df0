// Real recordings beside the repository; a test that needs one is skipped with a message where it is absent.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace parhelion::test {

inline std::filesystem::path recording(const std::string& relative) {
  return std::filesystem::path(PARHELION_DATA_DIR) / relative;
}

/// The recording that Debian's mrpt-common ships.
inline std::filesystem::path sena_rawlog() {
  return "/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog";
}

}  // namespace parhelion::test

#define PARHELION_NEEDS_RECORDING(path)                                        \
  if (!std::filesystem::exists(path)) {                                        \
    GTEST_SKIP() << "needs the recording " << (path) << ", which is not here"; \
  }

// Parsers and damaged text.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace parhelion::test {

/// Parses 2000 copies of the text `good` with flipped bytes, every fourth of them cut off. Each call must
/// return, more than half of the copies must be refused, and each error must start with the file's name. What
/// an accepted copy contains is not checked.
template <class Parse>
void expect_damaged_text_is_refused(Parse parse, const std::string& good, const std::string& name) {
  std::mt19937 random(7);
  int refused = 0;
  for (int round = 0; round < 2'000; ++round) {
    std::string bad = good;
    for (unsigned flips = 1 + random() % 4; flips > 0; --flips)
      bad[random() % bad.size()] = static_cast<char>(random());
    if (round % 4 == 0) bad.resize(random() % bad.size());
    const auto read = parse(bad, name);
    refused += read.ok() ? 0 : 1;
    if (!read) {
      EXPECT_EQ(read.error().message.rfind(name + ":", 0), 0U) << read.error().message;
    }
  }
  EXPECT_GT(refused, 1'000);
}

}  // namespace parhelion::test

// The semantic net on buildings that nobody has looked at: drawn at random, scanned by ray casting.
#include <gtest/gtest.h>

#include "tests/fusion/semantic/site_score.hpp"
#include "tests/long_run.hpp"

namespace parhelion::semantic {
namespace {

TEST(SemanticNetOnRandomSites, FindsMostOfWhatIsThere) {
  const std::uint64_t sites = test::long_run() ? 200 : 10;
  test::SiteScore score;
  for (std::uint64_t seed = 1; seed <= sites; ++seed) score += test::score_random_site(seed);
  std::printf("%d buildings\n", static_cast<int>(sites));
  score.print();
  EXPECT_GE(score.wall.precision(), 0.93);
  EXPECT_GE(score.wall.recall(), 0.92);
  EXPECT_GE(score.wall_length.precision(), 0.88);
  EXPECT_GE(score.floor.precision(), 0.95);
  EXPECT_GE(score.floor.recall(), 0.95);
  EXPECT_GE(score.ceiling.precision(), 0.97);
  EXPECT_GE(score.ceiling.recall(), 0.95);
  EXPECT_GE(score.pillar.recall(), 0.6);
  EXPECT_GE(score.door.precision(), 0.85);
  EXPECT_GE(score.door.recall(), 0.7);
  EXPECT_GE(score.step.precision(), 0.85);
  EXPECT_GE(score.step.recall(), 0.75);
  EXPECT_GE(score.window.precision(), 0.6);
  EXPECT_GE(score.window.recall(), 0.3);
}

}  // namespace
}  // namespace parhelion::semantic

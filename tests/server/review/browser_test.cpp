// The page in a real browser; the checks are in tests/browser/review.mjs.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "server/review/page.hpp"
#include "tests/server/review/written_session.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::review {
namespace {

const std::string kBrowserFolder = std::string(PARHELION_SOURCE_DIR) + "/tests/browser";

SessionReview reviewed(const test::WrittenSession& session, const std::string& path) {
  session.write(path);
  auto made = review_session(path);
  EXPECT_TRUE(made.ok()) << made.error().message;
  return std::move(*made);
}

TEST(BrowserTest, ThePageWorksByMouseKeyboardAndInPrint) {
  if (!std::filesystem::exists(kBrowserFolder + "/node_modules/playwright-core")) {
    // tools/test has installed it, so its absence is a failure there.
    ASSERT_EQ(std::getenv("PARHELION_BROWSER"), nullptr) << "no packages in " << kBrowserFolder;
    GTEST_SKIP() << "needs `npm ci` in " << kBrowserFolder;
  }
  const test::TemporaryFolder folder;
  test::WrittenSession session;
  session.scenario = "lesson</script><script>globalThis.ran = 1</script>";
  session.rule = "<img src=x onerror=globalThis.ran=2>";
  session.text = "<!--<script>\" onload='globalThis.ran = 3'";
  const auto score = [&](const char* name, const std::vector<double>& touches) {
    test::WrittenSession other = session;
    other.touches = touches;
    other.write(folder / "other.lcm");
    return SessionScore{name, session.scenario, runtime::grade_session(folder / "other.lcm")->grade};
  };
  ReviewPage page{{reviewed(session, folder / "a.lcm")}, {}, {}};
  page.earlier = {score("first.lcm", {3, 4, 5, 6, 7}), score("second.lcm", {})};
  page.group = {score("b.lcm", {3}), score("c.lcm", {3, 9})};
  std::ofstream(folder / "one.html") << to_html(page);
  session.touches = {9};
  std::ofstream(folder / "two.html") << to_html(
      {{page.sessions[0], reviewed(session, folder / "b.lcm")}, {}, {}});

  const char* kept = std::getenv("PARHELION_BROWSER_PICTURES");
  const auto ran = test::run({kBrowserFolder + "/review.mjs", folder / "one.html", folder / "two.html",
                              kept ? std::string(kept) : folder / ""},
                             folder / "node.txt", "/usr/bin/node");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_NE(ran.output.find("ok  no request leaves the page"), std::string::npos) << ran.output;
}

}  // namespace
}  // namespace parhelion::review

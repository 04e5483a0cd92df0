// `parhelion play` as a process, on damaged logs: it reports what is wrong, and ends in time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/mutation.hpp"
#include "tests/server/tick/graded_log.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;

class PlayRecording : public testing::Test {
 protected:
  /// Plays a session of 3 s, 100 times as fast.
  test::Ran play(const std::vector<Message>& messages) {
    test::write_log(log_, messages);
    return play();
  }
  test::Ran play() { return test::run({"play", log_, "--rate", "100"}, folder_ / "output.txt"); }

  const test::TemporaryFolder folder_;
  const std::string log_ = folder_ / "session.lcm";
};

TEST_F(PlayRecording, AnUndamagedLogIsPlayedSilently) {
  const auto ran = play(test::lesson(1, 2, true));
  EXPECT_EQ(ran.exit, 0);
  EXPECT_EQ(ran.output, "");
}

TEST_F(PlayRecording, AStampFarInTheFutureIsReportedAndNotWaitedFor) {
  auto messages = test::lesson(1, 2, true);
  messages[7].arrival = messages[7].arrival + seconds(3e9);
  const auto ran = play(messages);
  EXPECT_EQ(ran.exit, 0);
  EXPECT_THAT(ran.output,
              AllOf(ContainsRegex("session.lcm: byte [0-9]+: MR_WORLD is stamped 95.1 years later"),
                    HasSubstr("expected 0 to 60 s later"), HasSubstr("parhelion validate")));
}

TEST_F(PlayRecording, AllStampsAfterALongGapAreFollowedAtOnce) {
  auto messages = test::lesson(1, 2, true);
  for (std::size_t i = 7; i < messages.size(); ++i) messages[i].arrival = messages[i].arrival + seconds(3e9);
  const auto ran = play(messages);
  EXPECT_EQ(ran.exit, 0);
  EXPECT_THAT(ran.output, HasSubstr("the gap is left out"));
}

TEST_F(PlayRecording, DamagedEventHeadersAreReportedWithTheirByte) {
  test::write_log(log_, test::lesson(1, 2, true));
  std::string bytes = test::bytes_of(log_);
  const std::size_t second = bytes.find("\xED\xA1\xDA\x01", 4);
  ASSERT_NE(second, std::string::npos);
  bytes[second + 24] = '\x7f';  // the length of its payload
  test::replace_file(log_, bytes);
  const auto ran = play();
  EXPECT_EQ(ran.exit, 0);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("session.lcm: byte " + std::to_string(second) + ": "),
                                HasSubstr("expected 1..63 and 0..268435456"), HasSubstr("validate")));
  bytes[0] = 'x';
  test::replace_file(log_, bytes);
  const auto headless = play();
  EXPECT_EQ(headless.exit, 1);
  EXPECT_THAT(headless.output, AllOf(HasSubstr("expected MR_SESSION"), HasSubstr("byte 0: ")));
}

}  // namespace
}  // namespace parhelion::tools

// Fail-safe behaviour: a robot stops when the dead-man is released or its messages do not arrive.
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopDeskTest, MovesNothingBeforeTheDeadManWasLetGo) {
  auto page = open("anna");
  say(*page, R"({"type":"drive","robot":"trainee"})");
  heard();
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop])) << "a key that was held already";
  EXPECT_NE(page->texts("refused").back().find(R"("rearm":true)"), std::string::npos);
  say(*page, R"({"type":"release"})");
  twist(*page, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop]));
}

TEST_F(TeleopDeskTest, StopsAfterSilenceAndDoesNotStartAgainByItself) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  pass(0.28);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  pass(0.1);
  const auto stopped = heard()[channel::teleop];
  ASSERT_FALSE(stopped.empty());
  EXPECT_FALSE(moves(stopped));
  EXPECT_NE(page->texts("refused").back().find("release and press again"), std::string::npos);
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  say(*page, R"({"type":"release"})");
  twist(*page, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop]));
}

TEST_F(TeleopDeskTest, RepeatsTheStopOfALetGoDeadMan) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  say(*page, R"({"type":"release"})");
  pass(1);
  const auto stops = heard()[channel::teleop];
  EXPECT_GE(stops.size(), 4U);
  EXPECT_LE(stops.size(), 9U) << "and then it is silent";
  EXPECT_FALSE(moves(stops));
}

TEST_F(TeleopDeskTest, StopsWhenTheConnectionIsLost) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  close(*page);
  EXPECT_EQ(heard()[channel::teleop].back(), 0);
  EXPECT_EQ(words_.back().state, OperatorWord::State::lost);
  twist(*page, 0.5);
  EXPECT_TRUE(heard().empty()) << "what comes of a closed page is nothing";
}

TEST_F(TeleopDeskTest, LosesAPageThatIsSilentThoughItIsOpen) {
  auto page = open("anna");
  drive(*page);
  for (int i = 0; i < 10; ++i) {
    say(*page, R"({"type":"ping","at_ms":1})");
    pass(1);
  }
  EXPECT_EQ(desk_->driving().size(), 1U);
  EXPECT_EQ(page->texts("pong").size(), 10U);
  pass(1.1);
  EXPECT_TRUE(desk_->driving().empty());
  heard();
  EXPECT_EQ(words_.back().state, OperatorWord::State::lost);
}

}  // namespace
}  // namespace parhelion::station

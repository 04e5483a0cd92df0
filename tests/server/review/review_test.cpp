// One pass over the log gives everything that the page shows, and the page is harmless for any content of the
// log.
#include "server/review/review.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/review/page.hpp"
#include "tests/server/review/written_session.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::review {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class ReviewTest : public testing::Test {
 protected:
  SessionReview review(const test::WrittenSession& session, const ReviewLimits& limits = {}) {
    session.write(folder_ / "session.lcm");
    auto made = review_session(folder_ / "session.lcm", limits);
    EXPECT_TRUE(made.ok()) << made.error().message;
    return std::move(*made);
  }
  json page_of(const test::WrittenSession& session) {
    return json::parse(to_json(ReviewPage{{review(session)}, {}, {}}));
  }

  test::TemporaryFolder folder_;
};

TEST_F(ReviewTest, ScoreAndReasonsAreThoseOfGradeSession) {
  const SessionReview made = review({});
  const auto graded = runtime::grade_session(folder_ / "session.lcm");
  ASSERT_TRUE(graded.ok() && made.grade);
  EXPECT_EQ(made.grade->score, graded->grade.score);
  EXPECT_EQ(made.grade->score, 60 - 4 * (3 + 0.5 * 4));
  ASSERT_EQ(made.grade->deductions.size(), 4U);
  EXPECT_FALSE(made.cut_off);
  const json page = json::parse(to_json(ReviewPage{{made}, {}, {}}));
  const json& deduction = page["sessions"][0]["grade"]["deductions"][1];
  EXPECT_EQ(deduction["t"], 6.5);
  EXPECT_EQ(deduction["rule"], "touched a thing");
  EXPECT_EQ(deduction["points"], 5);
  EXPECT_EQ(deduction["cause"]["kind"], "contact_started");
  EXPECT_EQ(deduction["cause"]["object"], "barrel_1");
}

TEST_F(ReviewTest, TheInstructorsMarksStandAmongTheEvents) {
  std::ofstream(notes_path(folder_ / "session.lcm"))
      << R"({"at_us":1,"type":"mark","t":5.5,"by":"ines","text":"too fast here"})"
      << "\n"
      << R"({"at_us":2,"type":"chat","from":"ben","text":"hello"})"
      << "\n"
      << "half a li\n"
      << R"({"at_us":3,"type":"mark","t":2,"by":"ines","text":"<b>well done</b>"})"
      << "\n"
      << R"({"at_us":4,"type":"mark","t":"soon","by":"ines","text":"no time"})"
      << "\n";
  const json events = page_of({})["sessions"][0]["events"];
  std::vector<std::string> marks;
  double before = 0;
  for (const json& event : events) {
    EXPECT_GE(event["t"], before);
    before = event["t"];
    if (event["kind"] == "mark") marks.push_back(event["text"]);
  }
  EXPECT_EQ(marks, (std::vector<std::string>{"<b>well done</b>", "too fast here"}));
  const auto trainees = review_session(folder_ / "session.lcm", {}, {}, Reader::trainee);
  ASSERT_TRUE(trainees.ok());
  EXPECT_TRUE(trainees->marks.empty());
}

TEST_F(ReviewTest, ContainsTrackAndMeasurements) {
  const SessionReview made = review({});
  EXPECT_NEAR(made.duration, 20, 0.05);
  EXPECT_EQ(made.path.entity, "synthetic");
  for (const TrackPoint& point : made.path.track.points()) {
    const Eigen::Vector3d p = test::pose_at(point.t).translation();
    EXPECT_NEAR(std::hypot(point.x - p.x(), point.y - p.y()), 0, 1e-3);
  }
  ASSERT_EQ(made.agents.size(), 2U);
  EXPECT_EQ(made.agents[0].entity, "barrel_1");
  for (const char* name : {"speed", "pitch", "roll", "nearest", "nearest_injected", "commanded_forward",
                           "commanded_turn", "applied_forward", "applied_turn", "delay_scan", "delay_teleop"})
    EXPECT_EQ(made.series.count(name), 1U) << name;
  EXPECT_EQ(made.series.count("delay_camera"), 0U);
  const auto peak = [&](const char* name) {
    double largest = -1e9;
    for (const auto& sample : made.series.at(name).samples()) largest = std::max(largest, sample.value);
    return largest;
  };
  EXPECT_NEAR(peak("speed"), 0.2356, 1e-3);
  EXPECT_NEAR(peak("pitch"), 0.05 * 180 / std::numbers::pi, 0.05);
  EXPECT_NEAR(peak("roll"), 0, 1e-6);
  EXPECT_NEAR(peak("applied_forward"), 0.3, 1e-6);
  // A scan's delay is relative to the fastest one, with the microsecond resolution of the stamps.
  EXPECT_NEAR(peak("delay_scan") - made.min_delay.at("delay_scan"), 0.08, 1e-5);
}

TEST_F(ReviewTest, EachPenaltyHasTheLastShownPicture) {
  const SessionReview made = review({});
  EXPECT_EQ(made.pictures_seen, 300U);
  EXPECT_EQ(made.pictures_unreadable, 0U);
  for (const double t : test::WrittenSession{}.touches) {
    const bool there = std::any_of(made.pictures.begin(), made.pictures.end(), [&](const Picture& picture) {
      return picture.t <= t + 1.0 / 30 && picture.t > t - 0.1;
    });
    EXPECT_TRUE(there) << t;
  }
  render::JpegCodec codec;
  std::vector<std::uint8_t> bgr;
  const auto format = codec.decode(made.pictures.front().jpeg, bgr);
  ASSERT_TRUE(format.ok());
  EXPECT_EQ(format->width, 160);
}

TEST_F(ReviewTest, OnlyTheLargestPenaltiesKeepTheirPictures) {
  PictureChoice choice(2, 3);
  std::vector<std::uint8_t> bytes;
  const auto show = [&](double t) {
    Image image;
    image.stamp = SensorTime::from_utime(test::kStartUs);
    image.width = image.height = 8;
    image.row_stride = 8;
    image.format = PixelFormat::gray;
    image.bytes.assign(64, static_cast<std::uint8_t>(t));
    encode(image, bytes);
    choice.saw(t, std::vector(bytes));
  };
  for (int i = 0; i < 100; ++i) {
    show(i + 0.5);
    if (i == 30 || i == 60) choice.handle_deduction(10);
    if (i == 50 || i == 99) choice.handle_deduction(1);
  }
  choice.saw(200, {1, 2, 3});
  std::uint64_t unreadable = 0;
  const auto pictures = choice.finish(unreadable);
  EXPECT_EQ(unreadable, 1U);
  EXPECT_LE(pictures.size(), 2U + 6U);
  const auto has = [&](double t) {
    return std::any_of(pictures.begin(), pictures.end(), [&](const Picture& each) { return each.t == t; });
  };
  EXPECT_TRUE(has(30.5) && has(60.5));
  EXPECT_FALSE(has(50.5) || has(99.5));
}

TEST_F(ReviewTest, OneDamagedScanDoesNotEndTheReview) {
  test::WrittenSession session;
  session.broken_scan = 5;
  const SessionReview made = review(session), whole = review({});
  EXPECT_EQ(made.series.at("nearest").samples().size(), whole.series.at("nearest").samples().size());
  EXPECT_EQ(made.grade->score, whole.grade->score);
}

TEST_F(ReviewTest, UnmeasuredQuantitiesHaveNoSeries) {
  test::WrittenSession session;
  session.injected = false;  // without returns the nearest distance is infinite
  const SessionReview made = review(session);
  EXPECT_EQ(made.series.count("nearest"), 1U);
  EXPECT_EQ(made.series.count("nearest_injected"), 0U);
}

TEST_F(ReviewTest, ATruncatedLogIsShownToItsEnd) {
  test::WrittenSession session;
  session.end = false;
  const SessionReview made = review(session);
  EXPECT_TRUE(made.cut_off);
  EXPECT_FALSE(made.grade->complete);
  std::filesystem::resize_file(folder_ / "session.lcm",
                               std::filesystem::file_size(folder_ / "session.lcm") / 2 + 3);
  const auto half = review_session(folder_ / "session.lcm");
  ASSERT_TRUE(half.ok());
  EXPECT_GT(half->skipped_bytes, 0U);
}

TEST_F(ReviewTest, WithoutATrainingTheReviewHasNoScore) {
  test::WrittenSession session;
  session.training = false;
  EXPECT_FALSE(review(session).grade.has_value());
  EXPECT_TRUE(page_of(session)["sessions"][0]["grade"].is_null());
}

TEST_F(ReviewTest, AFileThatIsNoSessionLogIsRefused) {
  test::write_log(folder_ / "bare.lcm", test::drive(1));
  EXPECT_THAT(review_session(folder_ / "bare.lcm").error().message, HasSubstr("no MR_SESSION in it"));
  EXPECT_FALSE(review_session(folder_ / "missing.lcm").ok());
}

TEST_F(ReviewTest, EachKindOfEventIsListedAndOmissionsAreCounted) {
  test::WrittenSession session;
  session.touches.clear();
  for (int i = 0; i < 30; ++i) session.touches.push_back(2 + 0.1 * i);
  ReviewLimits limits;
  limits.events_of_kind = 10;
  const SessionReview made = review(session, limits);
  EXPECT_EQ(made.events.size(), 11U);
  EXPECT_EQ(made.events_left_out.at("contact_started"), 20U);
  EXPECT_EQ(made.grade->deductions.size(), 30U);
}

TEST_F(ReviewTest, NamesAreEscaped) {
  test::WrittenSession session;
  session.scenario = "</script><script>alert(1)</script>";
  session.rule = "<img src=x onerror=alert(2)>";
  session.text = "<!-- \xff -->{{script}}";
  const std::string html = to_html({{review(session)}, {}, {}});
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("<img src=x")));
  EXPECT_THAT(html, Not(HasSubstr("<!-- ")));
  EXPECT_EQ(page_of(session)["sessions"][0]["scenario"], session.scenario);
}

TEST_F(ReviewTest, ThePageIsReproducibleAndHasNoExternalLinks) {
  const std::string first = to_html({{review({})}, {}, {}}), second = to_html({{review({})}, {}, {}});
  EXPECT_EQ(first, second);
  EXPECT_THAT(first, HasSubstr("default-src 'none'"));
  EXPECT_THAT(first, Not(HasSubstr("{{")));
  EXPECT_THAT(first, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(first, Not(HasSubstr("url(")));
}

}  // namespace
}  // namespace parhelion::review

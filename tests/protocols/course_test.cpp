// Courses: valid and invalid files, and the rank of a trainee.
#include "protocols/course.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace parhelion {
namespace {

using testing::HasSubstr;

const std::string kWholeCourse = R"(course: operator
text: From the first metre on.
programmes:
  - {scenario: a.yaml, text: Forwards.}
  - {scenario: b.yaml}
  - {scenario: ../c.yaml}
  - {scenario: d.yaml}
ranking:
  - {name: master, passed: 4, from: 0.9}
  - {name: driver, passed: 4}
  - {name: learner, passed: 1}
)";

TEST(Course, KeepsTheOrderOfItsProgrammes) {
  const auto course = parse_course(kWholeCourse, "c.yaml");
  ASSERT_TRUE(course.ok()) << course.error().message;
  EXPECT_EQ(course->name, "operator");
  ASSERT_EQ(course->programmes.size(), 4U);
  EXPECT_EQ(course->programmes[0].text, "Forwards.");
  EXPECT_EQ(course->programmes[2].scenario, "../c.yaml");
  ASSERT_EQ(course->ranking.size(), 3U);
  EXPECT_EQ(course->ranking[0].from, 0.9);
}

TEST(Course, RanksByProgrammesPassedThenByPoints) {
  const auto course = parse_course(kWholeCourse, "c.yaml");
  ASSERT_TRUE(course.ok());
  EXPECT_EQ(standing_in(*course, {}).rank, "");
  EXPECT_EQ(standing_in(*course, {}).next, 0U);
  const CourseStanding begun = standing_in(*course, {ProgrammeResult{1, true}, ProgrammeResult{0.5, false}});
  EXPECT_EQ(begun.rank, "learner");
  EXPECT_EQ(begun.passed, 1U);
  EXPECT_EQ(begun.fraction, 1.5 / 4) << "what was not driven counts as nothing";
  EXPECT_EQ(begun.next, 1U);
  const auto all = [&](double fraction) {
    return standing_in(*course,
                       std::vector<std::optional<ProgrammeResult>>(4, ProgrammeResult{fraction, true}));
  };
  EXPECT_EQ(all(0.75).rank, "driver");
  EXPECT_EQ(all(1).rank, "master");
  EXPECT_FALSE(all(1).next.has_value());
  EXPECT_EQ(standing_in(*course, {{}, ProgrammeResult{1, true}, {}, ProgrammeResult{1, true}}).next, 0U);
}

TEST(Course, AMistakeIsNamedWithItsLine) {
  const std::string two = "course: c\nprogrammes: [{scenario: a.yaml}, {scenario: b.yaml}]\n";
  const struct {
    std::string yaml, words;
  } mistakes[] = {
      {"course: c\n", "'programmes'"},
      {"course: c\nprogrammes:\n  - {scenario: a.yaml}\n  - {scenario: a.yaml}\n",
       "c.yaml:4: scenario 'a.yaml' is a duplicate of line 3"},
      {two + "ranking: [{name: r, passed: 3}]\n",
       "c.yaml:3: rank 'r': cannot require 3 passed programmes, the course has 2"},
      {two + "ranking:\n  - {name: low, passed: 1}\n  - {name: high, passed: 2}\n",
       "c.yaml:5: rank 'high': expected the highest first"},
      {two + "rankng: []\n", "unknown key 'rankng', did you mean 'ranking'?"},
  };
  for (const auto& mistake : mistakes) {
    const auto course = parse_course(mistake.yaml, "c.yaml");
    ASSERT_FALSE(course.ok()) << mistake.yaml;
    EXPECT_THAT(course.error().message, HasSubstr(mistake.words)) << mistake.yaml;
  }
}

}  // namespace
}  // namespace parhelion

// Rankings of trainees.
#include "server/training/ranking.hpp"

#include "tests/server/training/records_fixture.hpp"

namespace parhelion::training {
namespace {

class Ranking : public test::OpenRecordsTest {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(OpenRecordsTest::SetUp());
    for (const char* name : {"Anna", "Ben", "Cem"}) {
      const auto added = records_->add({"", name, ""});
      ASSERT_TRUE(added.ok());
      pseudonyms_.push_back(added->pseudonym);
    }
  }
  void drove(int who, const std::string& scenario, double fraction, bool passed, double lasted = 60) {
    SessionRecord session = test::recorded_session(++sessions_);
    session.scenario = scenario;
    session.grade.fraction = fraction;
    session.grade.passed = passed;
    session.grade.end = session.grade.begin + seconds(lasted);
    ASSERT_TRUE(records_->store(pseudonyms_[static_cast<std::size_t>(who)], session).ok());
  }
  static std::string names(const auto& places) {
    std::string names;
    for (const auto& place : places) names += place.trainee.name + " ";
    return names;
  }

  std::vector<std::string> pseudonyms_;
  int sessions_ = 0;
};

TEST_F(Ranking, ProgrammesRankByEachTraineesBestSession) {
  drove(0, "doors", 0.95, false);  // a required task failed
  drove(0, "doors", 0.7, true);
  drove(1, "doors", 0.8, true, 100);
  drove(2, "doors", 0.8, true, 90);
  drove(0, "stairs", 1, true);
  const auto places = programme_ranking(*records_, "doors");
  ASSERT_TRUE(places.ok());
  EXPECT_EQ(names(*places), "Cem Ben Anna ");
  EXPECT_EQ((*places)[2].best.grade.fraction, 0.7);
  EXPECT_EQ((*places)[2].sessions, 2U);
  EXPECT_TRUE(programme_ranking(*records_, "unheard of")->empty());
}

TEST_F(Ranking, CoursesRankByPassedProgrammesThenPoints) {
  Course course;
  course.ranking = {{"operator", 2, 0.8}, {"beginner", 1, 0}};
  for (const char* name : {"doors", "stairs"}) {
    course.programmes.push_back({folder_ / (std::string(name) + ".yaml"), ""});
    std::ofstream(course.programmes.back().scenario) << "name: " << name << "\n";
  }
  drove(0, "doors", 1, true);
  drove(0, "stairs", 0.9, false);
  drove(1, "doors", 0.8, true);
  drove(1, "stairs", 0.8, true);
  const auto places = course_ranking(*records_, course);
  ASSERT_TRUE(places.ok()) << places.error().message;
  EXPECT_EQ(names(*places), "Ben Anna Cem ");
  EXPECT_EQ((*places)[0].standing.rank, "operator");
  EXPECT_EQ((*places)[1].standing.rank, "beginner");
  EXPECT_EQ((*places)[1].standing.next, 1U);
  EXPECT_NEAR((*places)[1].standing.fraction, 0.95, 1e-12);
  EXPECT_EQ((*places)[2].standing.rank, "");
  EXPECT_FALSE((*places)[2].best[0].has_value());
  course.programmes.push_back({folder_ / "gone.yaml", ""});
  EXPECT_FALSE(course_ranking(*records_, course).ok());
}

}  // namespace
}  // namespace parhelion::training

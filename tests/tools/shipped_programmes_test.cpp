// The shipped programmes of level 3, on the recorded drive that the demo maps and localizes.
#include <gtest/gtest.h>

#include "server/runtime/grade_session.hpp"
#include "server/runtime/replay.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

class Level3Programmes : public testing::Test {
 protected:
  /// The model and the localized log from the demo, where the scenarios refer to them.
  void SetUp() override {
    PARHELION_NEEDS_RECORDING(test::sena_rawlog());
    const std::string faculty = folder_ / "faculty";
    std::filesystem::create_directories(faculty);
    const auto run = [&](const std::vector<std::string>& arguments) {
      const auto ran = test::run(arguments, folder_ / "run.txt");
      ASSERT_EQ(ran.exit, 0) << ran.output;
    };
    run({"import", test::sena_rawlog(), "-o", faculty + "/recording.lcm"});
    run({"slam", "--log", faculty + "/recording.lcm", "--save-map", faculty + "/map"});
    run({"map", "extrude", faculty + "/map.yaml", "-o", faculty + "/model.yaml"});
    run({"slam", "--log", faculty + "/recording.lcm", "--map", faculty + "/map.yaml", "--start", "0,0,0",
         "-o", faculty + "/localized.lcm"});
  }
  Result<runtime::GradedSession> drive(const std::string& programme) {
    const std::string scenario = folder_ / (programme + ".yaml");
    std::filesystem::copy_file(
        std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/programmes/" + programme + ".yaml", scenario);
    runtime::ReplayOptions options;
    options.log = folder_ / "faculty/localized.lcm";
    options.scenario = scenario;
    options.session = folder_ / (programme + ".lcm");
    auto report = runtime::replay(options);
    if (!report) return report.error();
    report_ = std::move(*report);
    return runtime::grade_session(options.session);
  }

  test::TemporaryFolder folder_;
  runtime::Report report_;
};

TEST_F(Level3Programmes, TouchingAnInjectedRobotIsPenalized) {
  const auto round = drive("round_the_building");
  ASSERT_TRUE(round.ok()) << round.error().message;
  EXPECT_EQ(round->grade.score, 100) << runtime::to_text(*round);
  EXPECT_TRUE(round->grade.passed);

  const auto corridor = drive("corridor");
  ASSERT_TRUE(corridor.ok()) << corridor.error().message;
  const training::Grade& grade = corridor->grade;
  EXPECT_EQ(grade.tasks[0].outcome, training::TaskOutcome::done) << runtime::to_text(*corridor);
  EXPECT_EQ(grade.tasks[1].outcome, training::TaskOutcome::failed) << runtime::to_text(*corridor);
  ASSERT_FALSE(grade.deductions.empty());
  const training::Deduction& touch = grade.deductions.front();
  EXPECT_EQ(touch.rule, "touched the virtual robot");
  EXPECT_EQ(touch.cause->pair, PairKind::real_virtual);
  EXPECT_EQ(touch.cause->object, "robot_1");
  EXPECT_FALSE(touch.cause->undetectable);
  EXPECT_GT(report_.tally.beams_replaced, 50U) << "the laser saw it";
  EXPECT_FALSE(grade.passed);
}

}  // namespace
}  // namespace parhelion::tools

// The recording of Debian's mrpt-common repeatedly: a few laps by default, 24 hours of log time with
// PARHELION_LONG=1.
#include "tests/server/runtime/soak.hpp"

#include "protocols/bus/log_file.hpp"
#include "tests/long_run.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

TEST(Soak, MemoryStaysFlatOverManyLapsOfARealRecording) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  const test::TemporaryFolder folder;
  const auto ran = test::run({"demo", "--headless", "--fast", "--silent", "--folder", folder / "demo"},
                             folder / "demo.txt");
  ASSERT_EQ(ran.exit, 0) << ran.output;
  const auto scenario = load_scenario(folder / "demo/scenario.yaml");
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;
  const auto model = load_model(scenario->model);
  ASSERT_TRUE(model.ok()) << model.error().message;
  std::optional<RobotDescription> robot;
  std::vector<Message> log;
  auto reader = LogReader::open(folder / "demo/localized.lcm");
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  while (true) {
    auto next = reader->next();
    ASSERT_TRUE(next.ok()) << next.error().message;
    if (!*next) break;
    const Message& each = **next;
    RobotMessage description;
    if (each.channel == channel::kRobot && decode(each.channel, each.payload, description))
      robot = *parse_robot_description(description.yaml, "ROBOT");
    if (each.channel == channel::kScan || each.channel == channel::kOdometry ||
        each.channel == channel::kPoseCov)
      log.push_back(each);
  }
  ASSERT_TRUE(robot);
  const auto configuration = tick::configure(*scenario, *robot, *model);
  ASSERT_TRUE(configuration.ok()) << configuration.error().message;
  const bool whole_day = test::long_run();
  test::soak(*configuration, test::Laps(log, milliseconds(240)), seconds(whole_day ? 24 * 3600 : 300),
             whole_day ? 24 : 4);
}

}  // namespace
}  // namespace parhelion::tools

// A synthetic drive, repeated. tests/tools/soak_test.cpp uses a real one, in a long run.
#include "tests/server/runtime/soak.hpp"

#include "tests/long_run.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/synthetic.hpp"

namespace parhelion::runtime {
namespace {

TEST(Soak, MemoryStaysFlatOverManyLaps) {
  const bool stands_in = test::long_run() && !std::filesystem::exists(test::sena_rawlog());
  const tick::Configuration configuration =
      test::configuration({test::agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                           test::agent("person_1", AgentKind::person, -3, 1, BehaviourKind::wander),
                           test::agent("box_1", AgentKind::box, 0, 0)});
  auto log = test::drive(40);  // one turn of the circle, so that laps join without a jump
  std::erase_if(log, [](const Message& m) { return m.channel == channel::kRobot; });
  test::soak(configuration, test::Laps(log, milliseconds(25)), seconds(stands_in ? 24 * 3600 : 320),
             stands_in ? 24 : 8);
}

}  // namespace
}  // namespace parhelion::runtime

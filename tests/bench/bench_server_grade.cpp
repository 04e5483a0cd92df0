// An hour of a session, graded from its log: a minute of a synthetic drive at level 3 (events, worlds, scans,
// scan information) sixty times with shifted stamps. Prints the seconds of five runs.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "server/runtime/grade_session.hpp"
#include "server/runtime/replay.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace {

using namespace parhelion;

constexpr std::int64_t kMinuteUs = 60'000'000;
constexpr int kMinutes = 60;

Scenario lesson(const std::filesystem::path& folder) {
  Scenario scenario;
  scenario.name = "hour";
  scenario.model = folder / "model.yaml";
  for (int i = 0; i < 10; ++i)
    scenario.agents.push_back(
        test::agent("robot_" + std::to_string(i), AgentKind::robot, -4 + 0.8 * i, 3, BehaviourKind::wander));
  Training& training = scenario.training.emplace();
  Task& never = training.tasks.emplace_back();
  never.name = "never";
  never.points = 1000;
  never.done.event = EventKind::fell;
  Penalty& touch = training.penalties.emplace_back();
  touch.name = "touch";
  touch.points = 1;
  Penalty& near = training.penalties.emplace_back();
  near.name = "near";
  near.points = 1;
  near.when.kind = Condition::Kind::near;
  near.when.target = "robot_1";
  near.when.distance = 1;
  return scenario;
}

/// utime is the second member of every type here, for the clocks of world, event and session.
void move_on(Message& message, std::int64_t us) {
  message.arrival = message.arrival + microseconds(us);
  if (message.payload.size() < 16) return;
  std::uint64_t utime = 0;
  for (int i = 0; i < 8; ++i) utime = utime << 8 | message.payload[8 + static_cast<std::size_t>(i)];
  utime += static_cast<std::uint64_t>(us);
  for (int i = 7; i >= 0; --i, utime >>= 8)
    message.payload[8 + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(utime);
}

bool write_hour(const std::filesystem::path& minute, const std::filesystem::path& hour) {
  auto writer = LogWriter::create(hour, true);
  if (!writer) return false;
  for (int i = 0; i < kMinutes; ++i) {
    auto reader = LogReader::open(minute);
    if (!reader) return false;
    for (auto next = reader->next(); next && *next; next = reader->next()) {
      if (i > 0 && (*next)->channel == channel::kMrSession) continue;
      move_on(**next, i * kMinuteUs);
      if (!writer->write((*next)->channel, (*next)->arrival, (*next)->payload)) return false;
    }
  }
  return true;
}

}  // namespace

int main() {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "model.yaml") << to_yaml(test::room());
  std::ofstream(folder / "scenario.yaml")
      << to_yaml(lesson(std::filesystem::path(folder / "x").parent_path()));
  test::write_log(folder / "drive.lcm", test::drive(60));
  runtime::ReplayOptions options;
  options.log = folder / "drive.lcm";
  options.scenario = folder / "scenario.yaml";
  options.session = folder / "minute.lcm";
  const auto report = runtime::replay(options);
  if (!report) return std::fprintf(stderr, "%s\n", report.error().message.c_str()), 1;
  if (!write_hour(folder / "minute.lcm", folder / "hour.lcm"))
    return std::fprintf(stderr, "cannot write\n"), 1;
  std::printf("one hour: %.0f MB\n",
              static_cast<double>(std::filesystem::file_size(folder / "hour.lcm")) / 1e6);
  std::vector<double> times;
  for (int i = 0; i < 5; ++i) {
    const WallTime begun = runtime::steady_now();
    const auto graded = runtime::grade_session(folder / "hour.lcm");
    if (!graded) return std::fprintf(stderr, "%s\n", graded.error().message.c_str()), 1;
    times.push_back((runtime::steady_now() - begun).seconds());
    std::printf("graded in %.2f s: %.0f s of session, %zu deductions\n", times.back(),
                (graded->grade.end - graded->grade.begin).seconds(), graded->grade.deductions.size());
  }
  std::sort(times.begin(), times.end());
  std::printf("median %.2f s\n", times[2]);
  return 0;
}

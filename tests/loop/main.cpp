// Drives with the loop closed, and prints a row of a table for each.
//   parhelion_loop [DRIVES [FIRST SEED [FOLDER]]]
// FOLDER keeps the files of the drives.
#include <cstdio>
#include <string>

#include "tests/loop/closed_loop.hpp"
#include "tests/temporary_folder.hpp"

namespace {

using namespace parhelion;

void print(const test::DriveReport& drive) {
  std::string wrong;
  for (const std::string& failure : drive.failures()) wrong += (wrong.empty() ? "" : "; ") + failure;
  const std::string goals =
      drive.goal +
      (drive.other_goal.empty() || drive.other_goal == drive.goal ? "" : ", trainee: " + drive.other_goal);
  std::printf("| %llu | %s | %s | %.0f | %d | %d | %d | %.2f | %d of %d | %d | %.1f | %s |\n",
              static_cast<unsigned long long>(drive.seed), to_string(drive.arrangement), goals.c_str(),
              drive.seconds, drive.log.scans, drive.log.scans_shown, drive.log.contacts,
              drive.log.nearest_shown, drive.log.commands_reduced, drive.log.commands, drive.obstacle_stops,
              drive.score, wrong.empty() ? "none" : wrong.c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) try {
  const int drives = argc > 1 ? std::stoi(argv[1]) : 50;
  const std::uint64_t first = argc > 2 ? std::stoull(argv[2]) : 1;
  const test::TemporaryFolder temporary;
  int failed = 0, reached = 0, contacts = 0;
  std::printf(
      "| seed | arrangement | goal | s | scans | with virtual things | contacts | nearest, m | MR_CMD "
      "reduced | "
      "obstacle stops | score | violations |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (int i = 0; i < drives; ++i) {
    const std::uint64_t seed = first + static_cast<std::uint64_t>(i);
    const std::filesystem::path folder =
        (argc > 3 ? std::string(argv[3]) : temporary / "drives") + "/" + std::to_string(seed);
    std::filesystem::create_directories(folder);
    const auto drive =
        test::drive_loop(seed, static_cast<test::Arrangement>(i % test::kArrangements), folder);
    print(drive);
    failed += !drive.failures().empty();
    reached += drive.goal == "reached" && (drive.other_goal.empty() || drive.other_goal == "reached");
    contacts += drive.log.contacts;
    if (argc <= 3) std::filesystem::remove_all(folder);
  }
  std::printf("\n%d drives: %d reached all goals, %d contacts, %d with a violation\n", drives, reached,
              contacts, failed);
  return failed == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "parhelion_loop: %s\n", error.what());
  return 1;
}

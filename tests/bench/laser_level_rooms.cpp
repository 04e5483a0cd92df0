// Height and tilt of the laser as `parhelion calibrate` finds them in generated rooms, beside the truth.
//   laser_level_rooms boxes|office|warehouse|empty_hall FIRST_SEED LAST_SEED
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/tools/calibration/level_room.hpp"

namespace {

using parhelion::test::RoomStyle;

void print(const char* name, const parhelion::pose::Measured& found, double truth, double factor) {
  if (found.shown)
    std::printf("  %s %7.2f %+6.2f +- %.2f (%.1f sigma)", name, factor * truth,
                factor * (found.value - truth), factor * found.sigma,
                std::abs(found.value - truth) / found.sigma);
  else
    std::printf("  %s %7.2f     not shown          ", name, factor * truth);
}

}  // namespace

int main(int count, char** arguments) {
  using namespace parhelion;
  constexpr const char* kStyles[] = {"boxes", "office", "warehouse", "empty_hall"};
  constexpr double kDegrees = 180 / std::numbers::pi;
  int style = 0;
  while (count == 4 && style < 4 && std::strcmp(kStyles[style], arguments[1]) != 0) ++style;
  if (count != 4 || style == 4) {
    std::fprintf(stderr, "laser_level_rooms boxes|office|warehouse|empty_hall FIRST_SEED LAST_SEED\n");
    return 2;
  }
  for (int seed = std::atoi(arguments[2]); seed <= std::atoi(arguments[3]); ++seed) {
    const auto number = static_cast<std::uint32_t>(seed);
    const test::LevelTruth truth = test::random_truth(number);
    tools::LaserLevelFit fit(test::level_robot(truth));
    test::drive_level(number, static_cast<RoomStyle>(style), truth, fit);
    const auto level = fit.fit();
    std::printf("%d", seed);
    if (level.ok()) {
      print("cm", level->height, truth.laser_height, 100);
      print("deg", level->pitch, truth.laser_pitch, kDegrees);
      print("deg", level->roll, truth.laser_roll, kDegrees);
      std::printf("\n");
    } else {
      std::printf("  %s\n", level.error().message.c_str());
    }
  }
}

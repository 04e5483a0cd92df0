// A robot in a building of its own, on LCM: it publishes SCAN, ODOMETRY, JOINT_STATE, CAMERA, DEPTH and
// ROBOT, and obeys MR_CMD and MR_JOINT_CMD. For Parhelion it is a real robot.
//
//   example_robot                              in building.txt, as robot.yaml, driven by MR_CMD
//   example_robot --to 4,2.5 --to 8,2.5        drives itself to these points of the map, on MR_SCAN
//   example_robot --help
//
// The bus is LCM_DEFAULT_URL's, else this machine only.
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "arguments.hpp"
#include "robot.hpp"

namespace {

constexpr const char* kHelp =
    "usage: example_robot [OPTION VALUE]...\n"
    "  --building FILE       the true building (building.txt)\n"
    "  --description FILE    published on ROBOT (robot.yaml)\n"
    "  --to X,Y              m in the map, again for the next point: it drives itself there, on MR_SCAN\n"
    "  --speed M_PER_S       of a robot that drives itself (0.5)\n"
    "  --slip FRACTION       of the wheels, 1 sigma (0.02)\n"
    "  --clock-offset S      of its clock to the machine's (0)\n"
    "  --odometry-late S     of the encoders' stamps (0.01)\n"
    "  --image-rate HZ       of its cameras (2); 0: none\n"
    "  --seed N              of slip and noise (1)\n"
    "  --truth yes           publishes its true pose on REFERENCE_POSE\n";

volatile std::sig_atomic_t end = 0;

void request_end(int) { end = 1; }

void set(robot::Options& options, const std::string& option, const std::string& value) {
  if (option == "--building")
    options.building = value;
  else if (option == "--description")
    options.description = value;
  else if (option == "--to")
    options.route.push_back(robot::point(option, value));
  else if (option == "--speed")
    options.speed = robot::number(option, value);
  else if (option == "--slip")
    options.slip = robot::number(option, value);
  else if (option == "--clock-offset")
    options.clock_offset = robot::number(option, value);
  else if (option == "--odometry-late")
    options.odometry_late = robot::number(option, value);
  else if (option == "--image-rate")
    options.image_rate = robot::number(option, value);
  else if (option == "--seed")
    options.seed = static_cast<unsigned>(robot::number(option, value));
  else if (option == "--truth")
    options.truth = value == "yes";
  else
    throw std::invalid_argument(option + ": no such option");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "--help") return std::fputs(kHelp, stdout) < 0;
  try {
    robot::Options options;
    robot::read_arguments(argc, argv,
                          [&](const auto& option, const auto& value) { set(options, option, value); });
    lcm::LCM bus;
    if (!bus.good()) throw std::runtime_error("cannot open LCM; is there a multicast route?");
    robot::Robot robot(bus, options);
    std::signal(SIGINT, request_end);
    std::signal(SIGTERM, request_end);
    robot.run(end);
    std::printf("%s\n", robot.summary().c_str());
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "example_robot: %s\n%s", error.what(), kHelp);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "example_robot: %s\n", error.what());
    return 1;
  }
}

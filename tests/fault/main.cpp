// Injects faults into a live server that has a robot and a trainee, and prints what each one did.
//   parhelion_faults [PART OF A NAME]
//   parhelion_faults --stranger MINUTES: somebody without a key tries to make the robot move
//   parhelion_faults --set-clock: those that set this machine's clock, for two seconds each
#include <cmath>
#include <cstdio>
#include <string>
#include <thread>

#include "tests/fault/faults.hpp"
#include "tests/fault/stranger.hpp"

namespace {

using namespace parhelion;

constexpr double kFastest = 1.0;  // m/s, the limit of the robot under test

std::unique_ptr<Bus> connect(const std::string& url) {
  auto bus = open_network_bus(url);
  if (!bus) throw std::runtime_error(bus.error().message);
  return std::move(*bus);
}

template <class Condition>
bool comes_true(Condition condition, Duration within) {
  const WallTime until = runtime::steady_now() + within;
  while (!condition()) {
    if (runtime::steady_now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// Prints a row of the table; the reasons why the fault did harm, empty: none.
std::string run(const test::Fault& fault, int port) {
  test::ServerUnderTest server(port);
  auto receiving = connect(server.url());
  for (const char* channel : {"MR_CMD", "MR_SCAN"}) {
    if (!receiving->subscribe(channel, 100)) return "cannot subscribe";
  }
  test::StandInRobot robot(connect(server.url()), std::move(receiving));
  if (!comes_true([&] { return robot.record().answered > 5; }, seconds(20.0)))
    return "does not serve: " + server.output();
  robot.drive(true);
  if (!comes_true([&] { return robot.record().moves; }, seconds(5.0)))
    return "does not drive: " + server.output();
  const pid_t before = server.child();
  robot.mark();
  const WallTime injected = runtime::steady_now();
  test::FaultBed bed{server, robot};
  fault.inject(bed);
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const auto record = robot.record();
  const bool alive = server.supervisor().running() && server.child() != 0;

  std::string harm;
  const auto expect = [&](bool holds, const char* otherwise) {
    if (!holds) harm += (harm.empty() ? "" : ", ") + std::string(otherwise);
  };
  expect(fault.ends_server != alive, "the server is not as it should be");
  if (!fault.ends_server) expect(record.answered_again.has_value(), "no scan was answered again");
  if (!fault.is_noise) expect(record.stopped || record.fastest == 0, "the robot never stopped");
  if (fault.ends_server) expect(!record.moves, "the robot moves on");
  expect(record.fastest <= kFastest + 1e-9, "faster than the robot's limit");
  expect(fault.expected.empty() || server.output().find(fault.expected) != std::string::npos,
         "nothing was said");
  char stopped[64] = "-", again[32] = "-";
  if (record.stopped)
    std::snprintf(stopped, sizeof stopped, "%.0f ms%s", (*record.stopped - injected).seconds() * 1e3,
                  record.by_watchdog ? " (watchdog)" : "");
  if (!fault.ends_server && record.answered_again && server.child() != before)
    std::snprintf(again, sizeof again, "%.0f ms", (*record.answered_again - injected).seconds() * 1e3);
  std::printf("| %s | %d | %d | %s | %s | %.2f m/s | %s |\n", fault.name.c_str(), record.sent,
              record.answered, stopped, again, record.fastest, harm.empty() ? "none" : harm.c_str());
  std::fflush(stdout);
  return harm;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string argument = argc > 1 ? argv[1] : "";
  if (argument == "--stranger")
    return parhelion::test::withstands_stranger(20'000 + getpid() % 20'000,
                                                parhelion::seconds(60 * std::stod(argc > 2 ? argv[2] : "1")))
               ? 0
               : 1;
  const bool set_clock = argument == "--set-clock";
  const std::string wanted = set_clock ? "" : argument;
  int port = 20'000 + getpid() % 20'000, harmful = 0;
  std::printf(
      "| fault | scans sent | answered | first stop after | restarted, answers after | fastest MR_CMD | harm "
      "|\n"
      "|---|---|---|---|---|---|---|\n");
  for (const auto& fault : set_clock ? parhelion::test::clock_faults() : parhelion::test::all_faults()) {
    if (fault.name.find(wanted) == std::string::npos) continue;
    if (!run(fault, port++).empty()) ++harmful;
  }
  return harmful == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "parhelion_faults: %s\n", error.what());
  return 1;
}

#include "tests/fault/faults.hpp"

#include <sys/resource.h>
#include <sys/timex.h>

#include <chrono>
#include <stdexcept>
#include <thread>

#include "tests/protocols/raw_datagrams.hpp"

namespace parhelion::test {
namespace {

void wait(Duration span) { std::this_thread::sleep_for(std::chrono::nanoseconds(span.ns)); }

Datagram lying_fragment(std::uint32_t size, std::uint32_t offset, std::uint16_t index, std::uint16_t count,
                        std::size_t carried) {
  static std::uint32_t sequence = 0;
  return fragment({++sequence, size, offset, index, count}, channel::kScan, Datagram(carried, 7));
}

Message teleop(double speed) {
  return message(channel::kTeleop, 0, TwistCommand{{runtime::wall_now().ns}, {speed, 0, 0}});
}

Fault signal(const std::string& name, int number, bool of_supervisor, bool ends_server) {
  return {name,
          [=](FaultBed& bed) {
            kill(of_supervisor ? bed.server.supervisor().pid() : bed.server.child(), number);
          },
          ends_server};
}

Fault pause(const std::string& name, Duration span) {
  return {name, [=](FaultBed& bed) {
            const pid_t child = bed.server.child();
            kill(child, SIGSTOP);
            wait(span);
            kill(child, SIGCONT);
          }};
}

Fault datagrams(const std::string& name, int count, std::function<Datagram(int)> make) {
  return {.name = name,
          .inject =
              [=](FaultBed& bed) {
                const RawSender sender(bed.server.url());
                for (int i = 0; i < count; ++i) sender.send(make(i));
              },
          .is_noise = true};
}

Fault link(const std::string& name, const Link& link) {
  return {.name = name,
          .inject =
              [=](FaultBed& bed) {
                bed.robot.set_link(link);
                wait(seconds(3.0));
                bed.robot.set_link({});
              },
          .is_noise = true};
}

Fault limit(const std::string& name, __rlimit_resource resource, rlim_t value) {
  return {.name = name,
          .inject =
              [=](FaultBed& bed) {
                const rlimit limit{value, value};
                prlimit(bed.server.child(), resource, &limit, nullptr);
              },
          .is_noise = true};
}

/// Each core has more to do than it can.
void keep_busy(FaultBed&) {
  std::vector<std::jthread> loops;
  for (int i = 0; i < 4; ++i) {
    loops.emplace_back([](const std::stop_token& stop) {
      for (volatile std::uint64_t count = 0; !stop.stop_requested();) count = count + 1;
    });
  }
  wait(seconds(3.0));
}

/// Adds `span` to the machine's clock; false where this process may not.
bool step_machine_clock(Duration span) {
  constexpr std::int64_t ns_per_s = 1'000'000'000;
  timex step{};
  step.modes = ADJ_SETOFFSET | ADJ_NANO;
  step.time.tv_sec = span.ns >= 0 ? span.ns / ns_per_s : -((-span.ns + ns_per_s - 1) / ns_per_s);
  step.time.tv_usec = span.ns - step.time.tv_sec * ns_per_s;  // ns, never negative
  return clock_adjtime(CLOCK_REALTIME, &step) >= 0;
}

/// The clock of the server's machine; the robot keeps its own.
Fault machine_clock(Duration span) {
  const bool ahead = span.ns > 0;
  return {.name = "server's clock set " + std::to_string(std::abs(span.ns) / 1'000'000'000) + " s " +
                  (ahead ? "ahead" : "back"),
          .inject =
              [=](FaultBed& bed) {
                if (!step_machine_clock(span)) throw std::runtime_error("this process may not set the clock");
                bed.robot.set_clock(-span);
                wait(seconds(2.0));
                step_machine_clock(-span);
                bed.robot.set_clock({});
              },
          .is_noise = true};
}

void repeat_a_command(FaultBed& bed) {
  bed.robot.drive(false);
  wait(seconds(1.0));
  bed.robot.mark();
  const auto bus = open_network_bus(bed.server.url());
  const Message first = teleop(0.3);
  for (int i = 0; bus && i < 60; ++i) {
    (void)(*bus)->publish(first.channel, first.payload);
    wait(milliseconds(50));
  }
}

/// More people that walk than the machine can simulate, then an emergency stop: it must not wait for them.
void flood_with_people(FaultBed& bed) {
  constexpr int kSeconds = 10, kPerSecond = 3000;
  auto bus = open_network_bus(bed.server.url());
  if (!bus || !(*bus)->subscribe(channel::kMrEvents, 10'000)) throw std::runtime_error("no bus");
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-30, 30);
  const WallTime begun = runtime::steady_now();
  for (int i = 1; i <= kSeconds * kPerSecond; ++i) {
    AgentSpawn spawn;
    spawn.request = static_cast<std::uint64_t>(i);
    spawn.agent = agent("p" + std::to_string(i), AgentKind::person, place(random), place(random),
                        BehaviourKind::wander);
    const Message sent = message(channel::kMrSpawn, 0, spawn);
    (void)(*bus)->publish(sent.channel, sent.payload);
    const WallTime due = begun + seconds(i / static_cast<double>(kPerSecond));
    if (runtime::steady_now() < due) wait(due - runtime::steady_now());
  }
  EmergencyStopCommand stop;
  stop.request = 1'000'000;
  const Message sent = message(channel::kMrEmergencyStop, 0, stop);
  const WallTime engaged = runtime::steady_now();
  (void)(*bus)->publish(sent.channel, sent.payload);
  Message received;
  Event event;
  while (runtime::steady_now() < engaged + seconds(2.0)) {
    const auto any = (*bus)->receive(received, milliseconds(100));
    if (!any || !*any || !decode(received.channel, received.payload, event)) continue;
    if (event.request != stop.request) continue;
    std::fprintf(stderr, "the emergency stop was executed after %.0f ms\n",
                 (runtime::steady_now() - engaged).seconds() * 1e3);
    return;
  }
  throw std::runtime_error("the emergency stop was not executed within 2 s");
}

}  // namespace

std::vector<Fault> all_faults() {
  std::vector<Fault> faults{
      {.name = "none", .inject = [](FaultBed&) { wait(seconds(3.0)); }, .is_noise = true},
      signal("server killed (SIGKILL)", SIGKILL, false, false),
      signal("server crashed (SIGSEGV)", SIGSEGV, false, false),
      signal("server asked to end (SIGTERM)", SIGTERM, true, true),
      signal("^C (SIGINT)", SIGINT, true, true),
      signal("supervisor killed (SIGKILL)", SIGKILL, true, true),
      pause("server paused for 0.4 s (SIGSTOP)", milliseconds(400)),
      pause("server paused for 2 s (SIGSTOP)", seconds(2.0)),
      datagrams("fragment whose offset and size wrap 32 bits", 100,
                [](int) { return lying_fragment(100'000, 0xFFFF'FFF0U, 1, 2, 1000); }),
      datagrams("fragment that declares 60,000 bytes and carries 8", 100,
                [](int) { return lying_fragment(60'000, 0, 0, 1, 8); }),
      datagrams("61 bytes that declare 200 MB", 100,
                [](int) { return lying_fragment(200'000'000, 0, 0, 60'000, 36); }),
      datagrams("random datagrams", 10'000,
                [](int i) {
                  std::mt19937 random(static_cast<unsigned>(i));
                  Datagram bytes{'L', 'C', '0', static_cast<std::uint8_t>(i % 2 == 0 ? '2' : '3')};
                  for (auto left = random() % 100; left > 0; --left)
                    bytes.push_back(static_cast<std::uint8_t>(random()));
                  return bytes;
                }),
      {.name = "TELEOP of 10 m/s to this machine's own address",
       .inject =
           [](FaultBed& bed) {
             const RawSender sender(bed.server.url(), "127.0.0.1");
             for (int i = 0; i < 40; ++i, wait(milliseconds(50))) sender.send(short_message(teleop(10)));
           },
       .is_noise = true},
      {.name = "a malformed ROBOT",
       .inject =
           [](FaultBed& bed) {
             const RawSender sender(bed.server.url());
             sender.send(short_message(message(channel::kRobot, 0, RobotMessage{{}, "name: [rover"})));
           },
       .is_noise = true},
      {.name = "TELEOP of 1e6 m/s",
       .inject =
           [](FaultBed& bed) {
             const RawSender sender(bed.server.url());
             for (int i = 0; i < 40; ++i, wait(milliseconds(25))) sender.send(short_message(teleop(1e6)));
           },
       .is_noise = true},
      {"one TELEOP repeated for 3 s", repeat_a_command},
      {"30,000 people spawned in 10 s, then an emergency stop", flood_with_people},
      {.name = "two servers on the bus",
       .inject =
           [](FaultBed& bed) {
             const auto another = bed.server.another();
             wait(seconds(4.0));
           },
       .is_noise = true,
       .expected = "another server"},
      limit("no file may grow (RLIMIT_FSIZE 0)", RLIMIT_FSIZE, 0),
      limit("no more descriptors (RLIMIT_NOFILE 0)", RLIMIT_NOFILE, 0),
      limit("no more memory (RLIMIT_AS 0)", RLIMIT_AS, 0),
      {.name = "session log removed",
       .inject = [](FaultBed& bed) { std::filesystem::remove(bed.server.session()); },
       .is_noise = true,
       .expected = "the session is incomplete"},
      {.name = "four busy loops", .inject = keep_busy, .is_noise = true},
      link("link loses 20 %", {.lost = 0.2}),
      link("link repeats 20 %", {.repeated = 0.2}),
      link("link reorders 20 %", {.delayed = 0.2}),
  };
  for (const double hours : {1.0, -1.0}) {
    faults.push_back({.name = std::string("robot's clock set an hour ") + (hours > 0 ? "ahead" : "back"),
                      .inject =
                          [=](FaultBed& bed) {
                            bed.robot.set_clock(seconds(3600 * hours));
                            wait(seconds(2.0));
                          },
                      .is_noise = true});
  }
  return faults;
}

std::vector<Fault> clock_faults() {
  std::vector<Fault> faults;
  for (const double s : {2.0, -2.0, 3600.0, -3600.0}) faults.push_back(machine_clock(seconds(s)));
  return faults;
}

}  // namespace parhelion::test

// Places a virtual box in front of a robot, and prints the server's reply.
//
//   place_agent NAME X Y      m, in the map
//
// The server replies on MR_EVENTS. It refuses a place on the robot or inside its stopping distance, and a
// name that is taken; the reply gives the reason, and where there is room.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <lcm/lcm-cpp.hpp>
#include <random>
#include <string>

#include "parhelion/agent_spawn_t.hpp"
#include "parhelion/event_t.hpp"
#include "signature.hpp"

namespace {

using std::chrono::milliseconds;

// event_t.kind
constexpr int kCommandAccepted = 0;
constexpr int kCommandRefused = 1;

constexpr milliseconds kAnswerTimeout{2000};

std::int64_t now_us() {
  using namespace std::chrono;
  return duration_cast<microseconds>(system_clock::now().time_since_epoch()).count();
}

/// `utime` is when the command was sent, on this machine's clock. `request` is any number: the reply carries
/// it.
parhelion::agent_spawn_t spawn_box(const std::string& name, double x, double y) {
  parhelion::agent_spawn_t command{};
  command.utime = now_us();
  command.request = std::random_device{}();
  command.name = name;
  command.kind = 0;  // box
  command.x = x;
  command.y = y;
  command.size[0] = command.size[1] = 0.4;
  command.size[2] = 0.6;
  command.behaviour.kind = 0;  // stay
  return command;
}

/// The event that replies to one request.
class Answer {
 public:
  explicit Answer(std::int64_t request) : request_(request) {}
  void handle_event(const lcm::ReceiveBuffer*, const std::string&, const parhelion::event_t* event) {
    if (event->request != request_) return;
    if (event->kind != kCommandAccepted && event->kind != kCommandRefused) return;
    received_ = true;
    event_ = *event;
  }
  bool received() const { return received_; }
  bool accepted() const { return event_.kind == kCommandAccepted; }
  const std::string& reason() const { return event_.text; }

 private:
  std::int64_t request_;
  bool received_ = false;
  parhelion::event_t event_{};
};

/// False where LCM fails or no reply arrives in time.
bool wait_for(const Answer& answer, lcm::LCM& lcm) {
  const std::int64_t deadline = now_us() + std::chrono::microseconds(kAnswerTimeout).count();
  while (!answer.received()) {
    const std::int64_t left_ms = (deadline - now_us()) / 1000;
    if (left_ms <= 0 || lcm.handleTimeout(static_cast<int>(left_ms)) <= 0) return answer.received();
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: place_agent NAME X Y\n");
    return 2;
  }
  lcm::LCM lcm;  // at LCM_DEFAULT_URL, else on this machine only
  if (!lcm.good()) {
    std::fprintf(stderr, "place_agent: cannot open LCM; is there a multicast route?\n");
    return 1;
  }
  const auto command = spawn_box(argv[1], std::atof(argv[2]), std::atof(argv[3]));
  Answer answer(command.request);
  lcm.subscribe("MR_EVENTS", &Answer::handle_event, &answer);
  Publisher(lcm).publish("MR_SPAWN", command);
  if (!wait_for(answer, lcm)) {
    std::fprintf(stderr, "place_agent: no server answered; is `parhelion serve` running?\n");
    return 1;
  }
  if (!answer.accepted()) {
    std::fprintf(stderr, "place_agent: refused: %s\n", answer.reason().c_str());
    return 1;
  }
  std::printf("%s is placed\n", argv[1]);
  return 0;
}

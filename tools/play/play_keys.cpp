#include "tools/play/play_keys.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace parhelion::tools {
namespace {

constexpr double kLeap = 10;         // s
constexpr double kRateStep = 1.1;    // as in ros2 bag play
constexpr double kBackEnough = 0.5;  // s: a mark that has just been passed is skipped

std::string clock_text(double t) {
  char text[32];
  const int minutes = static_cast<int>(t / 60);
  std::snprintf(text, sizeof text, "%d:%04.1f", minutes, t - 60 * minutes);
  return text;
}

}  // namespace

void PlayKeys::feed(std::string_view bytes) {
  for (const station::Key key : bytes.empty() ? reader_.idle() : reader_.feed(bytes)) act(key);
}

bool PlayKeys::take_help() { return std::exchange(help_, false); }

void PlayKeys::act(station::Key key) {
  const runtime::PlayState now = player_.state();
  const auto rate = [&](double factor) {
    (void)player_.set_rate(
        std::clamp(now.rate * factor, runtime::Player::kSlowest, runtime::Player::kFastest));
  };
  switch (key) {
    case station::Key::stop:
      return player_.pause(!now.paused);
    case station::Key::right:
      if (now.paused)
        (void)player_.step();
      else
        (void)player_.seek(now.position + kLeap);
      return;
    case station::Key::left:
      return (void)player_.seek(now.position - kLeap);
    case station::Key::forward:
    case station::Key::faster:
      return rate(kRateStep);
    case station::Key::backward:
    case station::Key::slower:
      return rate(1 / kRateStep);
    case station::Key::next_joint:
    case station::Key::next_robot:
      return to_mark(true);
    case station::Key::previous_joint:
      return to_mark(false);
    case station::Key::joint_up:
      return (void)player_.seek(0);
    case station::Key::help:
      help_ = true;
      return;
    case station::Key::quit:
      quit_ = true;
      return;
    default:
      return;
  }
}

void PlayKeys::to_mark(bool forward) {
  const auto& marks = player_.recording().marks();
  const double position = player_.state().position;
  if (forward) {
    const auto next = std::find_if(marks.begin(), marks.end(), [&](const runtime::RecordedMark& mark) {
      return mark.t > position + 1e-6;
    });
    if (next != marks.end()) (void)player_.seek(next->t);
  } else {
    const auto before = std::find_if(marks.rbegin(), marks.rend(), [&](const runtime::RecordedMark& mark) {
      return mark.t < position - kBackEnough;
    });
    (void)player_.seek(before == marks.rend() ? 0 : before->t);
  }
}

const char* play_help() {
  return "  space            pause, resume\n"
         "  right arrow      paused: next message; playing: 10 s forward\n"
         "  left arrow       10 s back\n"
         "  up, down arrow   a tenth faster, slower\n"
         "  ] or Tab, [      next, previous mark: collisions, tasks, penalties\n"
         "  r                from the beginning\n"
         "  x or Esc         end\n";
}

std::string play_line(const runtime::PlayState& state) {
  char rate[32];
  std::snprintf(rate, sizeof rate, "  x%.3g", state.rate);
  return "  " + clock_text(state.position) + " of " + clock_text(state.duration) + rate +
         (state.ended    ? "  at the end"
          : state.paused ? "  paused"
                         : "");
}

}  // namespace parhelion::tools

#include "server/station/console/keyboard.hpp"

#include <algorithm>
#include <array>
#include <optional>

namespace parhelion::station {
namespace {

constexpr char kEscape = '\x1b';

std::optional<Key> key_of(char byte) {
  switch (byte) {
    case 'w':
    case 'W':
      return Key::forward;
    case 's':
    case 'S':
      return Key::backward;
    case 'a':
    case 'A':
      return Key::left;
    case 'd':
    case 'D':
      return Key::right;
    case 'q':
    case 'Q':
      return Key::forward_left;
    case 'e':
    case 'E':
      return Key::forward_right;
    case 'z':
    case 'Z':
      return Key::backward_left;
    case 'c':
    case 'C':
      return Key::backward_right;
    case ' ':
      return Key::stop;
    case '+':
    case '=':
      return Key::faster;
    case '-':
      return Key::slower;
    case '\t':
      return Key::next_robot;
    case ']':
      return Key::next_joint;
    case '[':
      return Key::previous_joint;
    case 'r':
    case 'R':
      return Key::joint_up;
    case 'f':
    case 'F':
      return Key::joint_down;
    case '?':
    case 'h':
    case 'H':
      return Key::help;
    case 'x':
    case 'X':
    case '\x03':
    case '\x04':
      return Key::quit;
    default:
      return std::nullopt;
  }
}

/// Arrow keys in a terminal's normal ("\e[A") and application mode ("\eOA").
std::optional<Key> arrow_of(char last) {
  switch (last) {
    case 'A':
      return Key::forward;
    case 'B':
      return Key::backward;
    case 'C':
      return Key::right;
    case 'D':
      return Key::left;
    default:
      return std::nullopt;
  }
}

bool is_motion(Key key) { return key <= Key::backward_right; }

/// Directions of vx and wz.
std::array<double, 2> direction(Key key) {
  switch (key) {
    case Key::forward:
      return {1, 0};
    case Key::backward:
      return {-1, 0};
    case Key::left:
      return {0, 1};
    case Key::right:
      return {0, -1};
    case Key::forward_left:
      return {1, 0.5};
    case Key::forward_right:
      return {1, -0.5};
    case Key::backward_left:
      return {-1, 0.5};
    case Key::backward_right:
      return {-1, -0.5};
    default:
      return {0, 0};
  }
}

}  // namespace

std::vector<Key> KeyReader::feed(std::string_view bytes) {
  std::vector<Key> keys;
  for (const char byte : bytes) {
    if (pending_.empty() && byte == kEscape) {
      pending_ = byte;
      continue;
    }
    if (pending_.empty()) {
      if (const auto key = key_of(byte)) keys.push_back(*key);
      continue;
    }
    if (pending_.size() == 1 && byte != '[' && byte != 'O') {  // Alt and a key, or Esc and then a key
      pending_.clear();
      if (byte == kEscape) keys.push_back(Key::quit), pending_ = byte;
      continue;
    }
    pending_ += byte;
    // A sequence ends with a letter or '~'; overlong sequences are skipped.
    const bool ends = pending_.size() > 2 && byte >= '@' && byte <= '~';
    if (!ends && pending_.size() < 16) continue;
    if (const auto key = arrow_of(byte); key && ends) keys.push_back(*key);
    pending_.clear();
  }
  return keys;
}

std::vector<Key> KeyReader::idle() {
  const bool alone = pending_.size() == 1;
  pending_.clear();
  return alone ? std::vector{Key::quit} : std::vector<Key>{};
}

void KeyboardDrive::hold(Held& held, Key key, WallTime now) const {
  const bool repeats = held.any && held.key == key && now < held.until;
  held = {key, true, now + (repeats ? options_.hold : options_.first_hold)};
}

void KeyboardDrive::press(Key key, WallTime now) {
  if (is_motion(key)) return hold(motion_, key, now);
  switch (key) {
    case Key::joint_up:
    case Key::joint_down:
      return hold(joint_, key, now);
    case Key::faster:
      step_ = std::min(step_ + 1, kSteps);
      return;
    case Key::slower:
      step_ = std::max(step_ - 1, 1);
      return;
    case Key::help:
      return;
    default:  // stop, and keys that change the robot or joint
      motion_.any = joint_.any = false;
  }
}

Twist2 KeyboardDrive::twist(WallTime now) const {
  if (!motion_.any || now >= motion_.until) return {};
  const auto [ahead, turn] = direction(motion_.key);
  const double scale = static_cast<double>(step_) / kSteps;
  return {ahead * scale * options_.speed, 0, turn * scale * options_.yaw_rate};
}

double KeyboardDrive::joint_speed(WallTime now) const {
  if (!joint_.any || now >= joint_.until) return 0;
  const double scale = static_cast<double>(step_) / kSteps;
  return (joint_.key == Key::joint_up ? 1 : -1) * scale * options_.joint_speed;
}

const char* keyboard_help() {
  return "  w s a d, arrows   forward, backward, turn left, right (hold to continue)\n"
         "  q e z c           arcs: forward left, right, backward left, right\n"
         "  space             stop\n"
         "  + -               faster, slower\n"
         "  [ ]               select a joint; r f move it up, down\n"
         "  Tab               drive the next robot\n"
         "  ? x               this help; end\n";
}

}  // namespace parhelion::station

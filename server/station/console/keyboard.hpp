// A keyboard as a console: converts bytes of a terminal to keys, and keys to a twist. Reads no clock.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"

namespace parhelion::station {

enum class Key : std::uint8_t {
  forward,         ///< w, up
  backward,        ///< s, down
  left,            ///< a, left: turns on the spot
  right,           ///< d, right
  forward_left,    ///< q: an arc, because a terminal cannot report two keys at once
  forward_right,   ///< e
  backward_left,   ///< z: turns like backward and a
  backward_right,  ///< c
  stop,            ///< space
  faster,          ///< +, =
  slower,          ///< -
  next_robot,      ///< Tab
  next_joint,      ///< ]
  previous_joint,  ///< [
  joint_up,        ///< r
  joint_down,      ///< f
  help,            ///< ?, h
  quit,            ///< x, Esc alone, ^C, ^D
};

/// Decodes keys from terminal input. An escape sequence may arrive in pieces; `pending` keeps an incomplete
/// one. Unknown keys and sequences are skipped.
class KeyReader {
 public:
  std::vector<Key> feed(std::string_view bytes);
  /// No input for a while: a pending Esc was the Esc key itself.
  std::vector<Key> idle();

 private:
  std::string pending_;
};

struct KeyboardOptions {
  double speed = 0.8, yaw_rate = 1.2;  ///< m/s and rad/s at the highest speed step
  double joint_speed = 0.5;            ///< rad/s or m/s
  /// A terminal does not report key releases. A key counts as held for `first_hold` after its first press
  /// (until the terminal begins to repeat it), and then for `hold` after each repeat.
  Duration first_hold = milliseconds(700), hold = milliseconds(150);
};

/// The twist and the joint speed that the keys command.
class KeyboardDrive {
 public:
  static constexpr int kSteps = 10;  ///< number of speed steps; the initial step is half of it

  explicit KeyboardDrive(const KeyboardOptions& options) : options_(options) {}
  void press(Key key, WallTime now);
  /// Zero when no key is held.
  Twist2 twist(WallTime now) const;
  /// rad/s or m/s of the selected joint.
  double joint_speed(WallTime now) const;
  int step() const { return step_; }

 private:
  struct Held {
    Key key = Key::stop;
    bool any = false;
    WallTime until;
  };
  void hold(Held& held, Key key, WallTime now) const;

  KeyboardOptions options_;
  int step_ = kSteps / 2;
  Held motion_, joint_;
};

/// One line for each key, for people.
const char* keyboard_help();

}  // namespace parhelion::station

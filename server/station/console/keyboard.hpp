// A keyboard as a console: bytes of a terminal to keys, keys to a twist. Pure: instants come from outside.
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
  forward_left,    ///< q: an arc, as no terminal tells two keys at once
  forward_right,   ///< e
  backward_left,   ///< z: turns as backward and a
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

/// Keys in what a terminal sent. An escape sequence may come in pieces: `pending` keeps what is not whole
/// yet. Unknown keys and sequences are passed over.
class KeyReader {
 public:
  std::vector<Key> feed(std::string_view bytes);
  /// Nothing has come for a while: an Esc that waits was the key itself.
  std::vector<Key> idle();

 private:
  std::string pending_;
};

struct KeyboardOptions {
  double speed = 0.8, yaw_rate = 1.2;  ///< m/s and rad/s at the highest step
  double joint_speed = 0.5;            ///< rad/s or m/s
  /// A terminal says no release. A key counts as held for `first_hold` after its first press (until the
  /// terminal begins to repeat it), and then for `hold` after each repeat.
  Duration first_hold = milliseconds(700), hold = milliseconds(150);
};

/// What the keys ask for, as held as a terminal can tell.
class KeyboardDrive {
 public:
  static constexpr int steps = 10;  ///< of speed; it starts at half

  explicit KeyboardDrive(const KeyboardOptions& options) : options_(options) {}
  void press(Key key, WallTime now);
  /// Zero once no key is held.
  Twist2 twist(WallTime now) const;
  /// rad/s or m/s of the chosen joint.
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
  int step_ = steps / 2;
  Held motion_, joint_;
};

/// One line a key, for people.
const char* keyboard_help();

}  // namespace parhelion::station

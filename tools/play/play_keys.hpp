// The keys of `ros2 bag play`, and a few more, on a player.
#pragma once

#include <string>
#include <string_view>

#include "server/runtime/play/player.hpp"
#include "server/station/console/keyboard.hpp"

namespace parhelion::tools {

class PlayKeys {
 public:
  explicit PlayKeys(runtime::Player& player) : player_(player) {}
  /// What was typed; empty: nothing in a while.
  void feed(std::string_view bytes);
  bool quit() const { return quit_; }
  /// The keys were asked for since the last call.
  bool take_help();

 private:
  void act(station::Key key);
  void to_mark(bool forward);

  runtime::Player& player_;
  station::KeyReader reader_;
  bool quit_ = false, help_ = false;
};

/// One line a key, for people.
const char* play_help();
/// "  1:05.2 of 3:20.0 s  x1  paused": one line for a person.
std::string play_line(const runtime::PlayState& state);

}  // namespace parhelion::tools

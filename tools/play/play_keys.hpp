// Controls a player with the keys of `ros2 bag play`, and a few more.
#pragma once

#include <string>
#include <string_view>

#include "server/runtime/play/player.hpp"
#include "server/station/console/keyboard.hpp"

namespace parhelion::tools {

class PlayKeys {
 public:
  explicit PlayKeys(runtime::Player& player) : player_(player) {}
  /// Typed bytes; empty: none for a while.
  void feed(std::string_view bytes);
  bool quit() const { return quit_; }
  /// True if the help key was pressed since the last call.
  bool take_help();

 private:
  void act(station::Key key);
  void to_mark(bool forward);

  runtime::Player& player_;
  station::KeyReader reader_;
  bool quit_ = false, help_ = false;
};

/// One line for each key, for people.
const char* play_help();
/// "  1:05.2 of 3:20.0 s  x1  paused": status line for people.
std::string play_line(const runtime::PlayState& state);

}  // namespace parhelion::tools

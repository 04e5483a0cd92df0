// A terminal in raw mode: each key is available when it is pressed.
#pragma once

#include <memory>
#include <string>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::station {

/// The destructor restores the terminal's settings.
class RawTerminal {
 public:
  /// Error: `file` is not a terminal.
  static Result<std::unique_ptr<RawTerminal>> open(int file);
  ~RawTerminal();
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  /// Typed bytes; empty: none within `timeout`. Error: the terminal is gone.
  Result<std::string> read(Duration timeout);

 private:
  struct State;
  explicit RawTerminal(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::station

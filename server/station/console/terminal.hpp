// A terminal that hands over each key as it is pressed.
#pragma once

#include <memory>
#include <string>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::station {

/// Put back as it was when this object goes.
class RawTerminal {
 public:
  /// Error: `file` is no terminal.
  static Result<std::unique_ptr<RawTerminal>> open(int file);
  ~RawTerminal();
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  /// What has been typed; empty: nothing within `timeout`. Error: the terminal is gone.
  Result<std::string> read(Duration timeout);

 private:
  struct State;
  explicit RawTerminal(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::station

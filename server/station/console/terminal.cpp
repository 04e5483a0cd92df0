#include "server/station/console/terminal.hpp"

#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace parhelion::station {

struct RawTerminal::State {
  int file = -1;
  termios before{};
};

RawTerminal::RawTerminal(std::unique_ptr<State> state) : state_(std::move(state)) {}

Result<std::unique_ptr<RawTerminal>> RawTerminal::open(int file) {
  auto state = std::make_unique<State>();
  state->file = file;
  if (isatty(file) == 0 || tcgetattr(file, &state->before) != 0)
    return Error{"standard input is not a terminal: run it in one"};
  termios raw = state->before;
  // No line buffering and no echo. ^C arrives as a key, so that the robot is stopped before the end.
  raw.c_lflag &= static_cast<tcflag_t>(~(ICANON | ECHO | ISIG | IEXTEN));
  raw.c_iflag &= static_cast<tcflag_t>(~(IXON | ICRNL));
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  if (tcsetattr(file, TCSANOW, &raw) != 0)
    return Error{std::string("the terminal cannot be set to raw mode: ") + std::strerror(errno)};
  return std::unique_ptr<RawTerminal>(new RawTerminal(std::move(state)));
}

RawTerminal::~RawTerminal() { (void)tcsetattr(state_->file, TCSANOW, &state_->before); }

Result<std::string> RawTerminal::read(Duration timeout) {
  pollfd waiting{state_->file, POLLIN, 0};
  const int ready = poll(&waiting, 1, static_cast<int>(timeout.ns / 1'000'000));
  if (ready < 0 && errno != EINTR) return Error{std::string("the terminal: ") + std::strerror(errno)};
  if (ready <= 0) return std::string();
  char bytes[64];
  const ssize_t count = ::read(state_->file, bytes, sizeof bytes);
  if (count > 0) return std::string(bytes, static_cast<std::size_t>(count));
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return std::string();
  return Error{"the terminal was closed"};
}

}  // namespace parhelion::station

// A stranger: hears everything on the bus, has no key, and tries for as long as it is told to make the robot
// move.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "protocols/bus/bus.hpp"
#include "tests/protocols/raw_datagrams.hpp"

namespace parhelion::test {

class Stranger {
 public:
  Stranger(std::string url, std::uint64_t seed);

  /// Hears what the others say for `time`, to repeat and to forge it later.
  void listen(Duration time);
  /// Sends one message of a kind chosen at random.
  void attack();
  /// Messages sent, by kind.
  const std::map<std::string, std::uint64_t>& sent() const { return sent_; }

 private:
  std::size_t below(std::size_t n) { return random_() % n; }
  const Message& received();
  Message forgery();
  Message damaged(Message message);
  Message with_trailer_of_another(Message message);
  Message signed_with_own_key(const Message& message);
  Datagram random_datagram();
  void publish(const char* kind, const Message& message);

  const std::string url_;
  std::unique_ptr<Bus> bus_;
  RawSender raw_, to_machine_;
  std::mt19937_64 random_;
  std::deque<Message> received_;
  std::map<std::string, std::uint64_t> sent_;
};

/// A server with keys, its robot behind `relay`, and a trainee who stopped; then a stranger for `time`.
/// Prints what was sent and what came of it; false: the robot moved, the stop was lifted, or they no longer
/// work afterwards.
bool withstands_stranger(int port, Duration time);

}  // namespace parhelion::test

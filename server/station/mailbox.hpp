// Queue of the station's worker: messages of the bus and of pages.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <variant>

#include "protocols/bus/bus.hpp"
#include "server/station/http/web_client.hpp"

namespace parhelion::station {

struct PageOpened {
  std::shared_ptr<WebClient> client;
};
struct PageSaid {
  std::uint64_t client = 0;
  std::string text;
};
struct PageClosed {
  std::uint64_t client = 0;
};
struct BusFailed {
  std::string why;
};
using Letter = std::variant<Message, PageOpened, PageSaid, PageClosed, BusFailed>;

/// Thread-safe and bounded. When it is full, messages wait in the bus, where the newest of each channel wins.
class Mailbox {
 public:
  static constexpr std::size_t most_messages = 64;  ///< of the bus
  static constexpr std::size_t most_texts = 4096;   ///< of pages

  /// Blocks until there is room. False: closed.
  bool put(Message message);
  /// Never blocks. False: the queue is full.
  bool put(PageSaid text);
  void put(PageOpened opened) { push(Letter(std::move(opened))); }
  void put(PageClosed closed) { push(Letter(closed)); }
  void put(BusFailed failed) { push(Letter(std::move(failed))); }
  /// False: nothing arrived within `timeout`, or closed.
  bool take(Letter& letter, Duration timeout);
  void close();

 private:
  void push(Letter letter);

  std::mutex mutex_;
  std::condition_variable came_, taken_;
  std::deque<Letter> letters_;
  std::size_t messages_ = 0, texts_ = 0;
  bool closed_ = false;
};

}  // namespace parhelion::station

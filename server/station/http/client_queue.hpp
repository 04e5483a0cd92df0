// Send queue of one client: bounded, newest wins by slot.
#pragma once

#include <deque>
#include <mutex>
#include <optional>

#include "server/station/http/web_client.hpp"

namespace parhelion::station {

/// The WebClient of an open connection. Producers call it from any thread; the connection takes from it.
class ClientQueue : public WebClient {
 public:
  /// `limit`: maximum bytes of in-order messages. `wake`: called, possibly from another thread, when a
  /// message is available after take() found none.
  ClientQueue(WebClientOrigin origin, std::size_t limit, std::function<void()> wake);

  void send(std::shared_ptr<const std::string> bytes, bool binary, int slot = kInOrder) override;
  std::size_t waiting_bytes() const override;
  void close(int code, std::string why) override;

  struct Message {
    std::shared_ptr<const std::string> bytes;
    bool binary = false;
    int slot = kInOrder;
  };
  struct Closing {
    int code = 1000;
    std::string why;
  };
  struct Next {
    std::optional<Message> message;
    std::optional<Closing> closing;  ///< reported once; nothing follows it
  };

  /// The next message to send; the previous one has been written.
  Next take();
  /// The connection is gone: messages are discarded from now on.
  void end();
  /// Number of messages replaced by newer ones.
  std::uint64_t replaced() const;

 private:
  /// Approximate cost of a message besides its bytes.
  static constexpr std::size_t kOverhead = 64;

  void request_close(int code, std::string why);
  void wake();

  mutable std::mutex mutex_;
  const std::size_t limit_;
  std::function<void()> wake_;
  std::deque<Message> messages_;
  std::optional<Closing> closing_;
  std::size_t waiting_ = 0, in_order_ = 0, writing_ = 0;
  std::uint64_t replaced_ = 0;
  bool awake_ = false, shut_ = false;
};

}  // namespace parhelion::station

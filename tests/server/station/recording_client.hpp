// A page without a socket that stores received messages.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/station/http/web_client.hpp"

namespace parhelion::station {

class RecordingClient : public WebClient {
 public:
  struct Sent {
    std::shared_ptr<const std::string> bytes;
    bool binary = false;
    int slot = kInOrder;
  };
  using WebClient::WebClient;

  static std::shared_ptr<RecordingClient> make(std::uint64_t id, const std::string& name, Role role,
                                               const std::string& query = "") {
    return std::make_shared<RecordingClient>(WebClientOrigin{id, {name, role}, "192.0.2.1", "/ws", query});
  }

  void send(std::shared_ptr<const std::string> bytes, bool binary, int slot = kInOrder) override {
    sent.push_back({std::move(bytes), binary, slot});
  }
  std::size_t waiting_bytes() const override { return waiting; }
  void close(int code, std::string) override { closed_with = code; }

  /// Received texts that contain `part`, in order.
  std::vector<std::string> texts(const std::string& part = "") const {
    std::vector<std::string> found;
    for (const Sent& each : sent) {
      if (!each.binary && each.bytes->find(part) != std::string::npos) found.push_back(*each.bytes);
    }
    return found;
  }

  std::vector<Sent> sent;
  std::size_t waiting = 0;
  int closed_with = 0;
};

}  // namespace parhelion::station

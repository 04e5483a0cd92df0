// A page that stores received messages: a WebClient without a socket.
#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/station/http/web_client.hpp"

namespace parhelion::test {

class ListeningClient : public station::WebClient {
 public:
  struct Sent {
    std::string bytes;
    bool binary = false;
    int slot = kInOrder;
  };
  explicit ListeningClient(std::uint64_t id, station::Role role = station::Role::instructor,
                           std::string name = "ada")
      : station::WebClient({id, {std::move(name), role}, "127.0.0.1", "/ws/state", ""}) {}

  void send(std::shared_ptr<const std::string> bytes, bool binary, int slot) override {
    sent.push_back({*bytes, binary, slot});
  }
  std::size_t waiting_bytes() const override { return 0; }
  void close(int code, std::string) override { closed = code; }

  /// All received texts of a type, in order.
  std::vector<nlohmann::json> messages_of_type(const std::string& type) const {
    std::vector<nlohmann::json> all;
    for (const Sent& each : sent) {
      if (each.binary) continue;
      auto message = nlohmann::json::parse(each.bytes);
      if (message.at("type") == type) all.push_back(std::move(message));
    }
    return all;
  }
  /// The newest received text of a type; null: none.
  nlohmann::json newest(const std::string& type) const {
    const auto all = messages_of_type(type);
    return all.empty() ? nlohmann::json() : all.back();
  }
  /// Binary messages of a kind.
  std::vector<std::string> frames(char kind) const {
    std::vector<std::string> all;
    for (const Sent& each : sent) {
      if (each.binary && each.bytes.front() == kind) all.push_back(each.bytes);
    }
    return all;
  }

  std::vector<Sent> sent;
  std::optional<int> closed;
};

}  // namespace parhelion::test

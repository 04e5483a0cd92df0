#include "server/station/foxglove/foxglove_server.hpp"

#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "server/runtime/wall_clock.hpp"
#include "server/station/foxglove/converter.hpp"
#include "server/station/foxglove/schemas.hpp"
#include "server/station/http/http_server.hpp"

namespace parhelion::station {
namespace {

using foxglove::Converted;
using nlohmann::json;

constexpr int kMaxWaiting = 512;  // messages of the bus
constexpr Duration kLook = milliseconds(100);
constexpr Duration kTimeInterval = milliseconds(20);
constexpr int kTimeSlot = 0;                     // of a client's queue; channels have theirs from 1
constexpr std::size_t kMaxSubscriptions = 1000;  // of one client

enum class StatusLevel : std::int8_t { info = 0, warning = 1, error = 2 };

std::shared_ptr<const std::string> shared(std::string text) {
  return std::make_shared<const std::string>(std::move(text));
}

json advertised(const foxglove::Channel& channel) {
  return {{"id", channel.id},
          {"topic", channel.topic},
          {"encoding", "json"},
          {"schemaName", channel.schema},
          {"schemaEncoding", "jsonschema"},
          {"schema", foxglove::schema_text(channel.schema)}};
}

void append_little_endian(std::string& bytes, std::uint64_t value, int size) {
  for (int shift = 0; shift < 8 * size; shift += 8) bytes += static_cast<char>(value >> shift & 0xFF);
}

/// Opcode 1: subscription, time, content.
std::shared_ptr<const std::string> message_data(std::uint32_t subscription, std::int64_t time,
                                                std::string_view content) {
  std::string bytes(1, '\x01');
  bytes.reserve(13 + content.size());
  append_little_endian(bytes, subscription, 4);
  append_little_endian(bytes, static_cast<std::uint64_t>(time), 8);
  return shared(std::move(bytes.append(content)));
}

/// Opcode 2: the current time.
std::shared_ptr<const std::string> time_message(std::int64_t time) {
  std::string bytes(1, '\x02');
  append_little_endian(bytes, static_cast<std::uint64_t>(time), 8);
  return shared(std::move(bytes));
}

struct Client {
  std::shared_ptr<WebClient> socket;
  std::map<std::uint32_t, std::uint16_t> subscriptions;  ///< subscription to channel
};

struct Offered {
  foxglove::Channel channel;
  std::int64_t time = 0;
  std::string kept;  ///< the last message, if the channel keeps it
};

}  // namespace

struct FoxgloveServer::Running {
  FoxgloveOptions options;
  std::unique_ptr<HttpServer> server;
  std::unique_ptr<Bus> bus;
  std::mutex mutex;
  std::map<std::uint64_t, Client> clients;
  std::map<std::uint16_t, Offered> offered;
  std::int64_t now = 0;  ///< ns, last time sent to clients
  foxglove::Converter converter{[this](const Converted& converted) { send(converted); },
                                [this](const foxglove::Channel& channel) { return wanted(channel); }};
  std::jthread thread;

  ~Running() {
    thread = {};
    server.reset();
  }

  void opened(std::shared_ptr<WebClient> socket);
  void received(WebClient& socket, std::string_view text, bool binary);
  void closed(const WebClient& socket);
  void subscribe(Client& client, const json& subscriptions);
  void offer(const foxglove::Channel& channel);
  void send_time();
  void send(const Converted& converted);
  void send_to(const Client& client, const foxglove::Channel& channel, std::uint32_t subscription,
               std::int64_t time, std::string_view content) const;
  bool wanted(const foxglove::Channel& channel);
  void run(const std::stop_token& stop);
};

namespace {

void complain(WebClient& socket, const std::string& what) {
  const json status{{"op", "status"}, {"level", static_cast<int>(StatusLevel::error)}, {"message", what}};
  socket.send(shared(status.dump(-1, ' ', false, json::error_handler_t::replace)), false);
}

}  // namespace

void FoxgloveServer::Running::opened(std::shared_ptr<WebClient> socket) {
  const std::lock_guard lock(mutex);
  const json info{{"op", "serverInfo"},
                  {"name", options.name},
                  {"capabilities", {"time"}},
                  {"supportedEncodings", {"json"}},
                  {"metadata", json::object()}};
  socket->send(shared(info.dump()), false);
  json channels = json::array();
  for (const auto& [id, each] : offered) channels.push_back(advertised(each.channel));
  if (!channels.empty())
    socket->send(shared(json{{"op", "advertise"}, {"channels", channels}}.dump()), false);
  socket->send(time_message(now), true, kTimeSlot);
  const std::uint64_t id = socket->id();
  clients[id] = {std::move(socket), {}};
}

void FoxgloveServer::Running::closed(const WebClient& socket) {
  const std::lock_guard lock(mutex);
  clients.erase(socket.id());
}

void FoxgloveServer::Running::received(WebClient& socket, std::string_view text, bool binary) {
  const std::lock_guard lock(mutex);
  const auto client = clients.find(socket.id());
  if (client == clients.end()) return;
  const json message = binary ? json() : json::parse(text, nullptr, false);
  if (!message.is_object() || !message.contains("op") || !message["op"].is_string())
    return complain(socket, "expected a JSON object with 'op'; this server accepts no binary messages");
  const std::string op = message["op"];
  if (op == "subscribe" && message.contains("subscriptions") && message["subscriptions"].is_array())
    return subscribe(client->second, message["subscriptions"]);
  if (op == "unsubscribe" && message.contains("subscriptionIds") && message["subscriptionIds"].is_array()) {
    for (const json& id : message["subscriptionIds"])
      if (id.is_number_unsigned()) client->second.subscriptions.erase(id.get<std::uint32_t>());
    return;
  }
  complain(socket, "'" + op.substr(0, 40) + "' is not supported; this server is read-only");
}

void FoxgloveServer::Running::subscribe(Client& client, const json& subscriptions) {
  for (const json& wish : subscriptions) {
    const bool sound = wish.is_object() && wish.contains("id") && wish["id"].is_number_unsigned() &&
                       wish.contains("channelId") && wish["channelId"].is_number_unsigned();
    if (!sound) {
      complain(*client.socket, "a subscription needs 'id' and 'channelId', both integers from 0");
      continue;
    }
    const auto channel = wish["channelId"].get<std::uint64_t>();
    const auto known = channel > 0xFFFF ? offered.end() : offered.find(static_cast<std::uint16_t>(channel));
    if (known == offered.end() || client.subscriptions.size() >= kMaxSubscriptions) {
      complain(*client.socket, "channel " + std::to_string(channel) + " is not there");
      continue;
    }
    const auto id = wish["id"].get<std::uint32_t>();
    client.subscriptions[id] = known->first;
    const Offered& each = known->second;
    if (!each.kept.empty()) send_to(client, each.channel, id, each.time, each.kept);
  }
}

void FoxgloveServer::Running::offer(const foxglove::Channel& channel) {
  offered[channel.id] = {channel, 0, {}};
  const auto text =
      shared(json{{"op", "advertise"}, {"channels", json::array({advertised(channel)})}}.dump());
  for (const auto& [id, client] : clients) client.socket->send(text, false);
}

/// Sent before messages of that time. A client whose time jumps back clears its view, so the messages that it
/// needs must follow; a newer time replaces one that still waits.
void FoxgloveServer::Running::send_time() {
  const std::int64_t read = options.clock().ns;
  if (read >= now && read - now < kTimeInterval.ns) return;
  now = read;
  const auto bytes = time_message(now);
  for (const auto& [id, client] : clients) client.socket->send(bytes, true, kTimeSlot);
}

/// Events are all sent; of other messages only the newest matters.
void FoxgloveServer::Running::send_to(const Client& client, const foxglove::Channel& channel,
                                      std::uint32_t subscription, std::int64_t time,
                                      std::string_view content) const {
  const bool counts = channel.schema == "foxglove.Log" || channel.schema == "foxglove.FrameTransforms";
  client.socket->send(message_data(subscription, time, content), true,
                      counts ? WebClient::kInOrder : static_cast<int>(channel.id));
}

void FoxgloveServer::Running::send(const Converted& converted) {
  const foxglove::Channel& channel = converted.channel;
  if (offered.count(channel.id) == 0) offer(channel);
  if (channel.keeps) {
    Offered& each = offered[channel.id];
    each.time = now;
    each.kept = converted.json;
  }
  for (const auto& [id, client] : clients)
    for (const auto& [subscription, to] : client.subscriptions)
      if (to == channel.id) send_to(client, channel, subscription, now, converted.json);
}

/// A channel that is not advertised yet is converted once, so that it will be.
bool FoxgloveServer::Running::wanted(const foxglove::Channel& channel) {
  if (offered.count(channel.id) == 0) return true;
  for (const auto& [id, client] : clients)
    for (const auto& [subscription, to] : client.subscriptions)
      if (to == channel.id) return true;
  return false;
}

void FoxgloveServer::Running::run(const std::stop_token& stop) {
  Message message;
  while (!stop.stop_requested()) {
    const auto came = bus->receive(message, kLook);
    if (!came) return;
    const std::lock_guard lock(mutex);
    send_time();
    if (!*came) continue;
    // The server counts messages that cannot be decoded.
    (void)converter.take(message);
  }
}

FoxgloveServer::FoxgloveServer(std::unique_ptr<Running> running) : running_(std::move(running)) {}
FoxgloveServer::~FoxgloveServer() = default;

Result<std::unique_ptr<FoxgloveServer>> FoxgloveServer::open(std::unique_ptr<Bus> bus,
                                                             const tick::Configuration& configuration,
                                                             const FoxgloveOptions& options) {
  auto running = std::make_unique<Running>();
  Running& all = *running;
  all.options = options;
  if (!options.clock) all.options.clock = [] { return ArrivalTime{runtime::wall_now().ns}; };
  all.now = all.options.clock().ns;
  HttpOptions http;
  http.address = options.host;
  http.port = options.port;
  http.open_to_all = true;
  auto server = HttpServer::open(std::move(http));
  if (!server) return server.error();
  all.server = std::move(*server);
  all.bus = std::move(bus);
  if (const Status subscribed = all.bus->subscribe(".*", kMaxWaiting); !subscribed) return subscribed.error();
  all.converter.begin(configuration, ArrivalTime{runtime::wall_now().ns});
  SocketHandler handler;
  handler.opened = [&all](std::shared_ptr<WebClient> socket) { all.opened(std::move(socket)); };
  handler.received = [&all](WebClient& socket, std::string_view text, bool binary) {
    all.received(socket, text, binary);
  };
  handler.closed = [&all](WebClient& socket) { all.closed(socket); };
  SocketTerms terms;
  terms.protocols = {"foxglove.sdk.v1", "foxglove.websocket.v1"};
  terms.programs = true;
  terms.origins = options.origins;
  all.server->on_socket("/", Access::everyone(), std::move(handler), std::move(terms));
  all.server->run();
  all.thread = std::jthread([&all](const std::stop_token& stop) { all.run(stop); });
  return std::unique_ptr<FoxgloveServer>(new FoxgloveServer(std::move(running)));
}

std::uint16_t FoxgloveServer::port() const { return running_->server->port(); }
std::string FoxgloveServer::address() const {
  return "ws://" + running_->options.host + ":" + std::to_string(port());
}

}  // namespace parhelion::station

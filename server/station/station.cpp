#include "server/station/station.hpp"

#include <cstdio>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "server/runtime/wall_clock.hpp"
#include "server/station/client_events.hpp"
#include "server/station/http/cached_content.hpp"
#include "server/station/mesh_json.hpp"

namespace parhelion::station {
namespace {

constexpr Duration kBusPeriod = milliseconds(5), kLookPeriod = milliseconds(20),
                   kBusAgain = milliseconds(500);
constexpr int kMaxMessagesAtOnce = 64;  // of the bus, between two events of pages

/// State for handlers on the server's thread.
struct Published {
  std::mutex mutex;
  SimulationTime start;
  CachedContent model, robots, trainees_robots;
  std::optional<CachedContent> texture;
  MeshContents meshes;
  SessionReport report;
  bool ending = false;  ///< a report will follow
  std::vector<std::pair<std::string, double>> status;
  std::size_t subscribers = 0;
};

FeedOptions feed_options(const StationOptions& options) {
  FeedOptions feed;
  feed.hello_fields.recorded = options.recorded;
  feed.hello_fields.mapped = options.map.has_value();
  feed.hello_fields.textured = options.texture != nullptr;
  feed.hello_fields.can_pause = static_cast<bool>(options.controls.pause);
  feed.hello_fields.can_rate = static_cast<bool>(options.controls.rate);
  feed.hello_fields.can_seek = static_cast<bool>(options.controls.seek);
  feed.hello_fields.can_end = static_cast<bool>(options.controls.end);
  feed.hello_fields.can_save = !options.scenarios.empty() && !options.recorded;
  if (options.controls.marks) feed.hello_fields.marks = options.controls.marks();
  feed.clock = options.clock ? options.clock : [] { return ArrivalTime{runtime::wall_now().ns}; };
  feed.control = options.controls.state;
  feed.stopped = options.stopped;
  return feed;
}

CachedContent texture_content(const SiteTexture& texture) {
  const std::vector<std::uint8_t> bytes = pack_site_texture(texture);
  constexpr int level = 1;  // most of it is a JPEG
  return cached_content("application/octet-stream", {bytes.begin(), bytes.end()}, level);
}

HttpResponse json(std::string body) { return {200, "application/json", std::move(body)}; }

}  // namespace

struct Station::Running {
  Running(std::unique_ptr<Bus> bus_, SessionNotes notes, StationOptions options_)
      : options(std::move(options_)),
        bus(std::move(bus_)),
        feed(options.configuration, feed_options(options)),
        instructor_service(*bus, feed, std::move(notes),
                           {controls(), options.emergency_stop, options.scenarios, options.audit}) {
    feed.event_received = [this](const Event& event) { instructor_service.handle(event); };
    feed.restarted = [this] {
      publish_start();
      for (Subscriber& subscriber : feed.subscribers().all()) instructor_service.greet(*subscriber.client);
    };
    feed.model_changed = [this](std::string model, std::uint64_t) { publish(std::move(model)); };
    publish(site_json(options.configuration->model, 0));
    published.robots = cached_content("application/json", robots_json(*options.configuration));
    published.meshes = mesh_contents(options.configuration->robot_models, options.configuration->objects);
    if (options.texture) published.texture = texture_content(*options.texture);
    published.trainees_robots = cached_content("application/json", robots_json(*options.configuration, true));
  }

  /// Those of the options, with a flag that remembers the end of the session.
  SessionControls controls() {
    SessionControls all = options.controls;
    if (!all.end) return all;
    all.end = [this, end = std::move(all.end)]() -> Status {
      if (Status ended = end(); !ended) return ended;
      const std::lock_guard lock(published.mutex);
      published.ending = true;
      return {};
    };
    return all;
  }

  void publish_figures() {
    const std::lock_guard lock(published.mutex);
    published.status = feed.status().values;
    published.subscribers = feed.subscribers().all().size();
  }
  void publish_start() {
    const std::lock_guard lock(published.mutex);
    published.start = feed.begun();
  }
  void publish(std::string model) {
    CachedContent kept = cached_content("application/json", std::move(model));
    const std::lock_guard lock(published.mutex);
    published.model = std::move(kept);
  }

  Status listen() {
    for (const auto& [channel, capacity] : feed.channels()) {
      if (Status subscribed = bus->subscribe(channel, capacity); !subscribed) return subscribed;
    }
    return {};
  }
  void add_routes(HttpServer& server);
  void add_report_routes(HttpServer& server);
  void add_socket(HttpServer& server);
  HttpResponse map() const;
  std::string hello(const Identity& who);
  void work(const std::stop_token& stop);
  void take_messages(WallTime now);
  void take(ClientEvent& event, WallTime now);

  const StationOptions options;
  std::unique_ptr<Bus> bus;
  WallTime bus_next;  ///< the bus is not read before: it has failed
  ClientEvents clients;
  StateFeed feed;
  InstructorService instructor_service;
  Published published;
  std::jthread worker;
};

void Station::Running::work(const std::stop_token& stop) {
  WallTime looked;
  ClientEvent event;
  while (!stop.stop_requested()) {
    const bool came = clients.take(event, kBusPeriod);
    const WallTime now = runtime::steady_now();
    if (came) take(event, now);
    take_messages(now);
    if (now - looked < kLookPeriod) continue;
    looked = now;
    feed.look(now);
    instructor_service.look(now);
    publish_figures();
  }
}

void Station::Running::take_messages(WallTime now) {
  if (now < bus_next) return;
  Message message;
  for (int i = 0; i < kMaxMessagesAtOnce; ++i) {
    const auto came = bus->receive(message, Duration{0});
    if (!came) {
      feed.bus_failed(came.error().message);
      bus_next = now + kBusAgain;
    }
    if (!came || !*came) return;
    feed.take(message, now);
  }
}

void Station::Running::take(ClientEvent& event, WallTime now) {
  if (auto* connected = std::get_if<ClientConnected>(&event)) {
    feed.open(connected->client);
    instructor_service.greet(*connected->client);
  } else if (auto* client_text = std::get_if<ClientText>(&event)) {
    if (const Subscriber* subscriber = feed.subscribers().find(client_text->client)) {
      const std::shared_ptr<WebClient> client = subscriber->client;
      instructor_service.receive(*client, client_text->text, now);
    }
  } else if (auto* closed = std::get_if<ClientDisconnected>(&event)) {
    feed.close(closed->client);
  }
}

std::string Station::Running::hello(const Identity& who) {
  HelloFields hello_fields = feed.hello_fields();
  hello_fields.now = runtime::wall_now();
  {
    const std::lock_guard lock(published.mutex);
    hello_fields.start = published.start;
  }
  return hello_json(*options.configuration, who, hello_fields);
}

HttpResponse Station::Running::map() const {
  if (!options.map) return refusal(404, "this session has no picture of a map");
  char resolution[32], origin[64];
  std::snprintf(resolution, sizeof resolution, "%.9g", options.map->resolution);
  std::snprintf(origin, sizeof origin, "%.9g,%.9g", options.map->origin.x(), options.map->origin.y());
  return {200, "image/png", options.map->png, {{"X-Resolution", resolution}, {"X-Origin", origin}}};
}

void Station::Running::add_routes(HttpServer& server) {
  const Access access = Access::logged_in();
  server.on("GET", "/api/v1/session", access,
            [this](const HttpRequest& request) { return json(hello(*request.who)); });
  server.on("GET", "/api/v1/model", access, [this](const HttpRequest& request) {
    const std::lock_guard lock(published.mutex);
    return answer_with(request, published.model);
  });
  server.on("GET", "/api/v1/map", access, [this](const HttpRequest&) { return map(); });
  server.on("GET", "/api/v1/cloud", access, [this](const HttpRequest&) {
    if (options.cloud.empty()) return refusal(404, "no cloud of this site was given (serve --cloud)");
    return HttpResponse{200, "application/octet-stream", options.cloud};
  });
  server.on("GET", "/api/v1/texture", access, [this](const HttpRequest& request) {
    if (!published.texture)
      return refusal(404, "this site has no recorded surfaces (`parhelion map texture` makes them)");
    return answer_with(request, *published.texture);
  });
  server.on("GET", "/api/v1/robots", access, [this](const HttpRequest& request) {
    return answer_with(request, is_trainee(*request.who) ? published.trainees_robots : published.robots);
  });
  // Its id is a function of its content: a trainee's page knows that of what it was shown.
  server.on("GET", "/api/v1/mesh", access, [this](const HttpRequest& request) {
    const auto mesh = published.meshes.find(request.query);
    if (mesh == published.meshes.end()) return refusal(404, "no robot of this session has this mesh");
    return answer_with(request, mesh->second);
  });
  add_report_routes(server);
  add_socket(server);
}

void Station::Running::add_report_routes(HttpServer& server) {
  const auto none = [this] {
    if (!published.ending) return refusal(404, "the session has not ended: there is no report yet");
    HttpResponse soon = refusal(503, "the session is being graded");
    soon.headers = {{"Retry-After", "1"}};
    return soon;
  };
  server.on("GET", "/api/v1/report", Access::logged_in(), [this, none](const HttpRequest& request) {
    const std::lock_guard lock(published.mutex);
    const SessionReport& report = published.report;
    const std::string& text = is_trainee(*request.who) ? report.trainees_json : report.json;
    return text.empty() ? none() : json(text);
  });
  server.on("GET", "/report", Access::logged_in(), [this, none](const HttpRequest& request) {
    const std::lock_guard lock(published.mutex);
    const SessionReport& report = published.report;
    const auto named = report.of_robots.find(request.query);
    const bool is_named = named != report.of_robots.end();
    if (!report.page.empty() && !is_named && !request.query.empty())
      return refusal(404, "no robot of this session has this name: /report?NAME");
    const std::string& instructors = is_named ? named->second.page : report.page;
    const std::string& trainees = is_named ? named->second.trainees_page : report.trainees_page;
    const std::string& page = is_trainee(*request.who) ? trainees : instructors;
    if (page.empty()) return none();
    // The page contains its script and its styles and requests nothing.
    HttpResponse response{200, "text/html; charset=utf-8", page};
    response.headers = {{"Content-Security-Policy",
                         "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src "
                         "data:; frame-ancestors 'none'"}};
    return response;
  });
}

void Station::Running::add_socket(HttpServer& server) {
  SocketHandler handler;
  handler.opened = [this](std::shared_ptr<WebClient> client) {
    clients.put(ClientConnected{std::move(client)});
  };
  handler.received = [this](WebClient& client, std::string_view bytes, bool binary) {
    if (binary) return client.close(1003, "expected text");
    if (!clients.put(ClientText{client.id(), std::string(bytes)})) client.close(1013, "too many messages");
  };
  handler.closed = [this](WebClient& client) { clients.put(ClientDisconnected{client.id()}); };
  server.on_socket("/ws/state", Access::logged_in(), std::move(handler));
}

Station::Station(std::unique_ptr<Running> running) : running_(std::move(running)) {}

Result<std::unique_ptr<Station>> Station::open(std::unique_ptr<Bus> bus, HttpServer& server,
                                               StationOptions options) {
  auto notes = SessionNotes::open(options.notes);
  if (!notes) return notes.error();
  auto running = std::make_unique<Running>(std::move(bus), std::move(*notes), std::move(options));
  if (const Status listens = running->listen(); !listens) return listens.error();
  running->add_routes(server);
  Running* it = running.get();
  running->worker = std::jthread([it](const std::stop_token& stop) { it->work(stop); });
  return std::unique_ptr<Station>(new Station(std::move(running)));
}

Station::~Station() = default;

void Station::set_report(SessionReport report) {
  const std::lock_guard lock(running_->published.mutex);
  running_->published.report = std::move(report);
}

void Station::add_metrics(MetricsText& text) {
  const std::lock_guard lock(running_->published.mutex);
  text.gauge("parhelion_clients", "Pages that show the session",
             static_cast<double>(running_->published.subscribers));
  for (const auto& [name, value] : running_->published.status)
    text.gauge("parhelion_status", "Figures of MR_STATUS, by their names", value, {{"name", name}});
}

}  // namespace parhelion::station

#include "server/station/station.hpp"

#include <cstdio>
#include <mutex>
#include <thread>
#include <utility>

#include "server/runtime/wall_clock.hpp"
#include "server/station/http/kept_content.hpp"
#include "server/station/mailbox.hpp"

namespace parhelion::station {
namespace {

constexpr Duration bus_poll = milliseconds(50), look_period = milliseconds(20), bus_again = milliseconds(500);

/// State for handlers on the server's thread.
struct Published {
  std::mutex mutex;
  SimulationTime start;
  KeptContent model, robots;
  std::string report, report_page;
  bool ending = false;  ///< a report will follow
  std::vector<std::pair<std::string, double>> status;
  std::size_t pages = 0;
};

FeedOptions feed_options(const StationOptions& options) {
  FeedOptions feed;
  feed.words.recorded = options.recorded;
  feed.words.mapped = options.map.has_value();
  feed.words.can_pause = static_cast<bool>(options.controls.pause);
  feed.words.can_rate = static_cast<bool>(options.controls.rate);
  feed.words.can_seek = static_cast<bool>(options.controls.seek);
  feed.words.can_end = static_cast<bool>(options.controls.end);
  feed.words.can_save = !options.scenarios.empty() && !options.recorded;
  if (options.controls.marks) feed.words.marks = options.controls.marks();
  feed.clock = options.clock ? options.clock : [] { return ArrivalTime{runtime::wall_now().ns}; };
  feed.control = options.controls.state;
  feed.stopped = options.stopped;
  return feed;
}

HttpResponse json(std::string body) { return {200, "application/json", std::move(body)}; }

}  // namespace

struct Station::Running {
  Running(std::unique_ptr<Bus> bus_, SessionNotes notes, StationOptions options_)
      : options(std::move(options_)),
        bus(std::move(bus_)),
        feed(options.configuration, feed_options(options)),
        desk(*bus, feed, std::move(notes),
             {controls(), options.emergency_stop, options.scenarios, options.audit}) {
    feed.heard_event = [this](const Event& event) { desk.hear(event); };
    feed.restarted = [this] {
      publish_start();
      for (Page& page : feed.pages().all()) desk.greet(*page.client);
    };
    feed.model_changed = [this](std::string model, std::uint64_t) { publish(std::move(model)); };
    publish(site_json(options.configuration->model, 0));
    published.robots = keep_content("application/json", robots_json(*options.configuration));
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
    published.pages = feed.pages().all().size();
  }
  void publish_start() {
    const std::lock_guard lock(published.mutex);
    published.start = feed.begun();
  }
  void publish(std::string model) {
    KeptContent kept = keep_content("application/json", std::move(model));
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
  void receive(const std::stop_token& stop);
  void work(const std::stop_token& stop);
  void take(Letter& letter);

  const StationOptions options;
  std::unique_ptr<Bus> bus;
  Mailbox mailbox;
  StateFeed feed;
  InstructorDesk desk;
  Published published;
  std::jthread receiver, worker;
};

void Station::Running::receive(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    Message message;
    const auto received = bus->receive(message, bus_poll);
    if (!received) {
      mailbox.put(BusFailed{received.error().message});
      std::this_thread::sleep_for(std::chrono::nanoseconds(bus_again.ns));
      continue;
    }
    if (*received && !mailbox.put(std::move(message))) return;
  }
}

void Station::Running::work(const std::stop_token& stop) {
  WallTime looked;
  Letter letter;
  while (!stop.stop_requested()) {
    if (mailbox.take(letter, look_period)) take(letter);
    const WallTime now = runtime::steady_now();
    if (now - looked < look_period) continue;
    looked = now;
    feed.look(now);
    desk.look(now);
    publish_figures();
  }
}

void Station::Running::take(Letter& letter) {
  const WallTime now = runtime::steady_now();
  if (auto* message = std::get_if<Message>(&letter)) {
    feed.take(*message, now);
  } else if (auto* opened_page = std::get_if<PageOpened>(&letter)) {
    feed.open(opened_page->client);
    desk.greet(*opened_page->client);
  } else if (auto* said = std::get_if<PageSaid>(&letter)) {
    if (const Page* page = feed.pages().find(said->client)) {
      const std::shared_ptr<WebClient> client = page->client;
      desk.receive(*client, said->text, now);
    }
  } else if (auto* closed = std::get_if<PageClosed>(&letter)) {
    feed.close(closed->client);
  } else if (auto* failed = std::get_if<BusFailed>(&letter)) {
    feed.bus_failed(failed->why);
  }
}

std::string Station::Running::hello(const Identity& who) {
  HelloWords words = feed.words();
  words.now = runtime::wall_now();
  {
    const std::lock_guard lock(published.mutex);
    words.start = published.start;
  }
  return hello_json(*options.configuration, who, words);
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
  server.on("GET", "/api/v1/robots", access,
            [this](const HttpRequest& request) { return answer_with(request, published.robots); });
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
  server.on("GET", "/api/v1/report", Access::logged_in(), [this, none](const HttpRequest&) {
    const std::lock_guard lock(published.mutex);
    return published.report.empty() ? none() : json(published.report);
  });
  server.on("GET", "/report", Access::logged_in(), [this, none](const HttpRequest&) {
    const std::lock_guard lock(published.mutex);
    if (published.report_page.empty()) return none();
    // The page contains its script and its styles and requests nothing.
    HttpResponse response{200, "text/html; charset=utf-8", published.report_page};
    response.headers = {{"Content-Security-Policy",
                         "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src "
                         "data:; frame-ancestors 'none'"}};
    return response;
  });
}

void Station::Running::add_socket(HttpServer& server) {
  SocketHandler handler;
  handler.opened = [this](std::shared_ptr<WebClient> client) { mailbox.put(PageOpened{std::move(client)}); };
  handler.received = [this](WebClient& client, std::string_view bytes, bool binary) {
    if (binary) return client.close(1003, "expected text");
    if (!mailbox.put(PageSaid{client.id(), std::string(bytes)})) client.close(1013, "too many messages");
  };
  handler.closed = [this](WebClient& client) { mailbox.put(PageClosed{client.id()}); };
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
  running->receiver = std::jthread([it](const std::stop_token& stop) { it->receive(stop); });
  running->worker = std::jthread([it](const std::stop_token& stop) { it->work(stop); });
  return std::unique_ptr<Station>(new Station(std::move(running)));
}

Station::~Station() {
  running_->receiver.request_stop();
  running_->worker.request_stop();
  running_->mailbox.close();
}

void Station::set_report(std::string json_text, std::string page) {
  const std::lock_guard lock(running_->published.mutex);
  running_->published.report = std::move(json_text);
  running_->published.report_page = std::move(page);
}

void Station::add_metrics(MetricsText& text) {
  const std::lock_guard lock(running_->published.mutex);
  text.gauge("parhelion_pages", "Pages that show the session",
             static_cast<double>(running_->published.pages));
  for (const auto& [name, value] : running_->published.status)
    text.gauge("parhelion_status", "Figures of MR_STATUS, by their names", value, {{"name", name}});
}

}  // namespace parhelion::station

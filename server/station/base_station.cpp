#include "server/station/base_station.hpp"

#include <charconv>

#include "protocols/channels.hpp"
#include "server/runtime/thread_priority.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/http/web_site.hpp"
#include "server/station/robot_watch.hpp"
#include "server/station/web/page_files.hpp"

namespace parhelion::station {
namespace {

constexpr int kStationNice = 5;  // pages must not take a core from the tick

bool is_own_machine(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

VideoOptions video_options(const StationOptions& station) {
  const tick::Configuration& configuration = *station.configuration;
  VideoOptions video;
  video.robot = configuration.robot.name;
  video.camera = configuration.channels.bus(channel::kMrCamera);
  video.original = configuration.channels.bus(channel::kCamera);
  for (std::size_t i = 1; i < configuration.robot_count(); ++i) {
    video.other_robots.push_back({configuration.robot_at(i).name,
                                  configuration.channels.bus(channel::kMrCamera, i),
                                  configuration.channels.bus(channel::kCamera, i)});
  }
  video.simulated = tick::simulates_trainee(configuration.scenario);
  video.agent_camera = [all = station.configuration](const std::string& agent) {
    return all->channels.bus(agent_camera_channel(agent));
  };
  video.now = [] { return runtime::steady_now(); };
  video.stamp = [] { return SensorTime{runtime::wall_now().ns}; };
  if (station.clock) video.session = [clock = station.clock] { return SensorTime{clock().ns}; };
  return video;
}

void add_video(const VideoCounts& counts, MetricsText& text) {
  const auto count = [&text](const char* name, const char* help, std::uint64_t value) {
    text.counter(name, help, static_cast<double>(value));
  };
  count("parhelion_video_pictures_total", "Pictures received for at least one viewer.", counts.pictures);
  count("parhelion_video_refused_total", "Pictures that could not be decoded.", counts.refused);
  count("parhelion_video_coded_total", "Pictures encoded as H.264.", counts.coded);
  count("parhelion_video_keys_total", "Key frames among them.", counts.keys);
  count("parhelion_video_bytes_total", "Bytes of H.264.", counts.bytes);
  count("parhelion_video_sent_total", "Pictures sent, over all pages.", counts.sent);
  count("parhelion_video_left_out_total", "Pictures skipped, over all pages.", counts.left_out);
  text.counter("parhelion_video_coding_seconds_total", "Encoding time.", counts.coding_s);
}

}  // namespace

Result<HostPort> parse_host_port(const std::string& text) {
  const Error fault{"address '" + text + "': expected ADDR:PORT, as 127.0.0.1:8080 or [::]:8443"};
  const std::size_t colon = text.rfind(':');
  HostPort parsed;
  parsed.host = colon == std::string::npos ? "" : text.substr(0, colon);
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  if (parsed.host.empty()) parsed.host = "127.0.0.1";
  if (parsed.host.front() == '[') {
    if (parsed.host.size() < 3 || parsed.host.back() != ']') return fault;
    parsed.host = parsed.host.substr(1, parsed.host.size() - 2);
  } else if (parsed.host.find(':') != std::string::npos) {
    return fault;
  }
  const auto [end, code] = std::from_chars(port.data(), port.data() + port.size(), parsed.port);
  if (port.empty() || code != std::errc{} || end != port.data() + port.size()) return fault;
  return parsed;
}

struct BaseStation::Parts {
  /// The site is destroyed last: the others write to its audit log until their end.
  ~Parts() {
    if (site) site->stop();
    station.reset();
    watch.reset();
    video.reset();
    teleop.reset();
  }

  std::unique_ptr<Bus> teleop_bus;
  std::unique_ptr<TeleopService> teleop;
  std::unique_ptr<VideoFeed> video;
  std::unique_ptr<RobotWatch> watch;
  std::unique_ptr<Station> station;
  std::unique_ptr<WebSite> site;

  Status open(BaseStationOptions options);
  Status open_driving(const BaseStationOptions& options);
  Status open_video(const BaseStationOptions& options);
};

Status BaseStation::Parts::open_driving(const BaseStationOptions& options) {
  if (options.station.recorded) return {};
  auto bus = options.open_bus();
  if (!bus) return bus.error();
  teleop_bus = std::move(*bus);
  TeleopOptions teleop_options;
  teleop_options.now = [] { return runtime::steady_now(); };
  teleop_options.stamp = [] { return SensorTime{runtime::wall_now().ns}; };
  teleop_options.emergency_stops = options.station.configuration->channels.bus(channel::kMrEmergencyStop);
  for (std::size_t i = 0; i < options.station.configuration->robot_count(); ++i)
    teleop_options.robots.push_back(options.station.configuration->robot_at(i).name);
  for (const std::string& robot : options.stopped_robots)
    teleop_options.active_stops.push_back({robot, "the server that died"});
  teleop_options.audit = [&audit = site->audit()](const std::string& who, const std::string& what) {
    audit.record({who, {}, what, "done"});
  };
  teleop = std::make_unique<TeleopService>(*teleop_bus, std::move(teleop_options));
  site->server().on_socket("/ws/teleop", Access::only({Role::trainee, Role::instructor, Role::admin}),
                           teleop->socket());
  return {};
}

Status BaseStation::Parts::open_video(const BaseStationOptions& options) {
  auto video_bus = options.open_bus(), watch_bus = options.open_bus();
  if (!video_bus) return video_bus.error();
  if (!watch_bus) return watch_bus.error();
  video = std::make_unique<VideoFeed>(std::move(*video_bus), video_options(options.station));
  site->server().on_socket("/ws/video", Access::logged_in(), video->socket());
  site->server().on_stream("/video.mjpg", Access::logged_in(), VideoFeed::kStreamType, video->stream());
  watch = std::make_unique<RobotWatch>(std::move(*watch_bus), options.station.configuration, *video,
                                       teleop.get(), options.why_not_driven);
  return watch->start();
}

Status BaseStation::Parts::open(BaseStationOptions options) {
  const auto at = parse_host_port(options.address);
  if (!at) return at.error();
  WebSiteOptions web;
  web.http.address = at->host;
  web.http.port = at->port;
  web.folder = options.folder.empty() ? default_site_folder() : options.folder;
  web.plain = options.plain.value_or(is_own_machine(at->host));
  web.page = page_response;
  auto opened = WebSite::open(std::move(web));
  if (!opened) return opened.error();
  site = std::move(*opened);
  auto bus = options.open_bus();
  if (!bus) return bus.error();
  if (Status driving = open_driving(options); !driving) return driving;
  if (Status pictures = open_video(options); !pictures) return pictures;
  StationOptions& station_options = options.station;
  station_options.audit = [&audit = site->audit()](const Identity& who, const std::string& remote,
                                                   const std::string& what, const std::string& outcome) {
    audit.record({who.name, remote, what, outcome});
  };
  if (teleop) {
    station_options.emergency_stop = [this](bool on, const std::string& robot, const Identity& who) {
      if (on) return teleop->stop(robot, who.name);
      const bool any = who.role == Role::instructor || who.role == Role::admin;
      return any ? teleop->release_stop(robot, who.name) : teleop->release_own_stop(robot, who.name);
    };
    station_options.stopped = [this] { return !teleop->stops().empty(); };
  }
  auto made = Station::open(std::move(*bus), site->server(), std::move(station_options));
  if (!made) return made.error();
  station = std::move(*made);
  site->metrics([this](MetricsText& text) {
    station->add_metrics(text);
    add_video(video->counts(), text);
  });
  video->start();
  site->run();
  return {};
}

BaseStation::BaseStation(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

Result<std::unique_ptr<BaseStation>> BaseStation::open(BaseStationOptions options) {
  auto parts = std::make_unique<Parts>();
  const Status opened =
      runtime::with_lower_priority(kStationNice, [&] { return parts->open(std::move(options)); });
  if (!opened) return opened.error();
  return std::unique_ptr<BaseStation>(new BaseStation(std::move(parts)));
}

BaseStation::~BaseStation() = default;

std::string BaseStation::address() const { return parts_->site->address(); }
std::string BaseStation::setup_link() const { return parts_->site->setup_link(); }
std::string BaseStation::fingerprint() const { return parts_->site->fingerprint(); }
std::string BaseStation::link(Role role, const std::string& name) { return parts_->site->link(role, name); }

std::string BaseStation::invitation() const {
  std::string text = "base station at " + address() + "\n";
  if (!fingerprint().empty()) text += "  certificate SHA-256 " + fingerprint() + "\n";
  if (const std::string setup = setup_link(); !setup.empty())
    text += "  there is no account yet; create the first one (once): " + setup + "\n";
  if (const std::string& fault = parts_->site->restore_fault(); !fault.empty())
    text += "  the stored log-ins were ignored, so everybody has to log in again: " + fault + "\n";
  return text;
}

void BaseStation::end_driving() {
  if (parts_->teleop) parts_->teleop->end_session();
}

void BaseStation::set_report(SessionReport report) { parts_->station->set_report(std::move(report)); }

}  // namespace parhelion::station

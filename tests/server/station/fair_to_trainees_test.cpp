// What a trainee's connection receives of things that his robot has not sensed: nothing. Every shipped
// scenario is served by a real server and base station, a trainee is connected to all that a page can open,
// and every byte that he gets is searched for the names and places that only the instructor's side knows.
#include <gmock/gmock.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <thread>

#include "protocols/channels.hpp"
#include "protocols/line_in_box.hpp"
#include "server/runtime/knowledge.hpp"
#include "server/runtime/loop.hpp"
#include "server/runtime/session_clock.hpp"
#include "server/runtime/session_files.hpp"
#include "server/simulation/robots/base_body.hpp"
#include "server/station/base_station.hpp"
#include "tests/file_bytes.hpp"
#include "tests/server/station/http/raw_client.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::station {
namespace {

using Json = nlohmann::json;
using parhelion::test::RawAnswer;
using parhelion::test::RawClient;

const std::string kScenarios = std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/";

/// Everything that a trainee's page can ask for. A route that is in the sources and not here fails the test.
const std::set<std::string> kSockets{"/ws/state", "/ws/teleop", "/ws/video"};
const std::set<std::string> kPages{"/",
                                   "/api/v1/me",
                                   "/api/v1/session",
                                   "/api/v1/model",
                                   "/api/v1/map",
                                   "/api/v1/cloud",
                                   "/api/v1/texture",
                                   "/api/v1/robots",
                                   "/api/v1/mesh",
                                   "/api/v1/report",
                                   "/api/v1/accounts",
                                   "/api/v1/audit",
                                   "/report",
                                   "/healthz",
                                   "/enter"};
/// Pictures only, and posted ones, whose replies concern accounts; metrics are for this machine and for
/// others than trainees.
const std::set<std::string> kOthers{"/video.mjpg",      "/api/v1/login", "/api/v1/setup", "/api/v1/logout",
                                    "/api/v1/password", "/setup",        "/metrics"};

TEST(FairToTrainees, EveryRouteOfTheStationIsSearchedForWhatATraineeMustNotKnow) {
  const std::regex route(R"re(on(_late|_socket|_stream)?\(\s*("[A-Z]+",\s*)?"(/[^"]*)")re");
  std::set<std::string> unknown;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(std::string(PARHELION_SOURCE_DIR) + "/server/station")) {
    if (entry.path().extension() != ".cpp" || entry.path().string().find("/foxglove/") != std::string::npos)
      continue;
    const std::string text = test::bytes_of(entry.path());
    for (std::sregex_iterator at(text.begin(), text.end(), route), end; at != end; ++at) {
      const std::string path = (*at)[3];
      if (!kSockets.contains(path) && !kPages.contains(path) && !kOthers.contains(path)) unknown.insert(path);
    }
  }
  EXPECT_THAT(unknown, ::testing::IsEmpty()) << "add it here, and what it sends is searched";
}

/// Pages of /ws/state are sent to by Audience, which asks what each may be told.
TEST(FairToTrainees, OnlyTheAudienceSendsToPagesOfTheSession) {
  const std::map<std::string, int> known{
      {"audience.cpp", 1},                // the gate itself
      {"state_feed.cpp", 3},              // scans and points of the followed robot, by view
      {"state_feed_subscribers.cpp", 1},  // worlds, by view
      {"instructor_service.cpp", 4}};     // replies, chat by its recipients, marks not to trainees
  const std::regex sends(R"((client->send|client\.send)\()");
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(PARHELION_SOURCE_DIR) + "/server/station")) {
    const std::string name = entry.path().filename().string();
    if (entry.path().extension() != ".cpp" || name.starts_with("teleop_")) continue;
    const std::string text = test::bytes_of(entry.path());
    const auto count = std::distance(std::sregex_iterator(text.begin(), text.end(), sends), {});
    const auto allowed = known.find(name);
    EXPECT_EQ(count, allowed == known.end() ? 0 : allowed->second)
        << name << ": send by Audience, which decides who may see what";
  }
}

/// All that a socket receives until it is closed.
class Listener {
 public:
  Listener(std::uint16_t port, const std::string& path, const std::string& cookie) : client_(port) {
    opened_ = client_.open_socket(path, cookie).status == 101;
    if (opened_) thread_ = std::thread([this] { listen(); });
  }
  bool opened() const { return opened_; }
  void send(const std::string& text) { client_.send_text(text); }
  std::vector<RawClient::Frame> frames() {
    if (thread_.joinable()) thread_.join();
    return std::move(frames_);
  }

 private:
  void listen() {
    while (auto frame = client_.frame()) {
      if (frame->opcode == 8) return;
      frames_.push_back(std::move(*frame));
    }
  }
  RawClient client_;
  bool opened_ = false;
  std::vector<RawClient::Frame> frames_;
  std::thread thread_;
};

/// Keys of JSON are no names.
bool has_name(const std::string& text, const std::string& word) {
  const auto is_letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if (text.compare(end, 2, "\":") == 0) continue;
    if ((at == 0 || !is_letter(text[at - 1])) && (end == text.size() || !is_letter(text[end]))) return true;
  }
  return false;
}

/// Pairs of numbers that may be places: neighbours in a list, and x beside y in an object.
void collect_places(const Json& json, std::vector<Eigen::Vector2d>& places) {
  if (json.is_array()) {
    for (std::size_t i = 0; i + 1 < json.size(); ++i)
      if (json[i].is_number() && json[i + 1].is_number())
        places.emplace_back(json[i].get<double>(), json[i + 1].get<double>());
  }
  if (json.is_object() && json.contains("x") && json.contains("y") && json["x"].is_number() &&
      json["y"].is_number())
    places.emplace_back(json["x"].get<double>(), json["y"].get<double>());
  if (json.is_structured())
    for (const Json& each : json) collect_places(each, places);
}

/// x and y of the bodies in binary message 1.
void collect_bodies(const std::string& frame, std::vector<Eigen::Vector2d>& places) {
  if (frame.size() < 16 || frame[0] != 1) return;
  for (std::size_t at = 16; at + 32 <= frame.size(); at += 32) {
    float xy[2];
    std::memcpy(xy, frame.data() + at + 4, sizeof xy);
    places.emplace_back(xy[0], xy[1]);
  }
}

class FairSession {
 public:
  FairSession(const std::string& scenario, Role role) : role_(role) {
    auto files = runtime::load_session_files(kScenarios + scenario, "");
    if (files && files->robot) {
      auto made = tick::configure(files->scenario, *files->robot, files->model, files->robot_models);
      EXPECT_TRUE(made) << made.error().message;
      if (made) configuration_ = std::move(*made);
      return;
    }
    load_on_open_floor(kScenarios + scenario);
  }

  void run(double s) {
    const auto clock = std::make_shared<runtime::SessionClock>();
    const bool simulated = tick::simulates_trainee(configuration_.scenario);
    if (simulated) clock->set_rate(4);
    ASSERT_TRUE(witness_->subscribe("MR_.*", 100'000).ok());
    BaseStationOptions options;
    options.folder = folder_ / "site";
    options.plain = true;
    options.station.configuration = std::make_shared<const tick::Configuration>(configuration_);
    if (simulated) options.station.clock = [clock] { return clock->now(); };
    options.open_bus = [this] { return Result<std::unique_ptr<Bus>>(hub_.connect()); };
    auto opened = BaseStation::open(std::move(options));
    ASSERT_TRUE(opened) << opened.error().message;
    BaseStation& station = **opened;
    std::atomic<bool> stop = false;
    std::thread server([&] {
      runtime::ServeOptions serving;
      if (simulated) serving.clock = clock;
      serving.stop = [&] { return stop.load(); };
      const auto served = runtime::serve(*server_bus_, configuration_, serving);
      EXPECT_TRUE(served.ok()) << served.error().message;
    });
    listen(station, s);
    stop = true;
    server.join();
    opened->reset();  // closes the sockets
    for (auto& [path, listener] : listeners_)
      for (RawClient::Frame& frame : listener->frames()) take(path, frame);
    for (Message message; *witness_->receive(message, Duration{0});) observe(message);
  }

  /// Each name and place of something that was not sensed, with the path that it came on.
  std::vector<std::string> leaks() const {
    std::vector<std::string> found;
    const std::set<std::string> names = secret_names(runtime::trainee_briefing(configuration_));
    for (const auto& [path, text] : texts_)
      for (const std::string& name : names)
        if (has_name(text, name)) found.push_back("name on " + path + ": " + around(text, name));
    const auto secrets = secret_places();
    for (const auto& [path, places] : places_) {
      for (const auto& secret : secrets) {
        const bool published = std::any_of(places.begin(), places.end(), [&](const Eigen::Vector2d& place) {
          return (place - secret.second).norm() < 0.02;
        });
        if (published) found.push_back("place on " + path + ": " + secret.first);
      }
    }
    return found;
  }
  std::size_t received() const {
    std::size_t bytes = 0;
    for (const auto& [path, text] : texts_) bytes += text.size();
    return bytes;
  }

 private:
  /// The models of level 3 are made from recordings: the scenario stands on open floor, with a robot whose
  /// pose is not known, and nothing can be sensed.
  void load_on_open_floor(const std::string& scenario) {
    auto parsed = load_scenario(scenario);
    ASSERT_TRUE(parsed) << parsed.error().message;
    parsed->model.clear();
    auto made = tick::configure(*parsed, test::robot(), test::room());
    ASSERT_TRUE(made) << made.error().message;
    configuration_ = std::move(*made);
  }
  static std::string around(const std::string& text, const std::string& name) {
    const std::size_t at = text.find(name);
    return text.substr(at < 200 ? 0 : at - 200, 400);
  }
  std::string cookie(BaseStation& station, std::uint16_t port) const {
    const std::string link = station.link(role_, "tess");
    const RawAnswer answer = RawClient(port).get(link.substr(link.find("/enter")));
    const std::string header = answer.headers.at("set-cookie");
    return header.substr(0, header.find(';'));
  }

  void listen(BaseStation& station, double s) {
    const std::string address = station.address();
    const auto port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
    const std::string trainee = cookie(station, port);
    for (const std::string& path : kSockets) open(path, port, trainee);
    for (const AgentDefinition& agent : configuration_.scenario.agents)
      open("/ws/video?robot=" + agent.name, port, trainee);
    Json wants{{"type", "subscribe"}, {"scan", true}, {"points", true}, {"agent_scans", Json::array()}};
    for (const AgentDefinition& agent : configuration_.scenario.agents)
      if (wants["agent_scans"].size() < 8) wants["agent_scans"].push_back(agent.name);
    listeners_.at("/ws/state")->send(wants.dump());
    // Who asks for a robot that he must not know learns nothing from the refusal; what he typed is his.
    listeners_.at("/ws/teleop")->send(R"({"type":"drive","robot":"x"})");
    drive(s);
    for (const std::string& path : kPages) {
      const RawAnswer answer = RawClient(port).get(path, trainee);
      texts_[path] += answer.body;
      collect_places(Json::parse(answer.body, nullptr, false), places_[path]);
    }
  }
  void open(const std::string& path, std::uint16_t port, const std::string& cookie) {
    auto listener = std::make_unique<Listener>(port, path, cookie);
    EXPECT_TRUE(listener->opened()) << path;
    listeners_[path] = std::move(listener);
  }
  /// Ahead and round, as a trainee who looks about.
  void drive(double s) {
    const std::unique_ptr<Bus> console = hub_.connect();
    std::vector<std::uint8_t> payload;
    const WallTime end = runtime::steady_now() + seconds(s);
    for (int i = 0; runtime::steady_now() < end; ++i) {
      encode(TwistCommand{SensorTime{runtime::wall_now().ns}, {0.4, 0, i % 40 < 20 ? 0.6 : -0.2}}, payload);
      EXPECT_TRUE(console->publish(channel::kTeleop, payload).ok());
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  void take(const std::string& path, const RawClient::Frame& frame) {
    if (frame.opcode == 1) collect_places(Json::parse(frame.payload, nullptr, false), places_[path]);
    if (frame.opcode == 2) collect_bodies(frame.payload, places_[path]);
    // What he asked for is echoed to him: his own words.
    if (path.starts_with("/ws/video?")) {
      const std::string own = path.substr(path.find('=') + 1);
      std::string text = frame.payload;
      for (std::size_t at = text.find(own); at != std::string::npos; at = text.find(own))
        text.erase(at, own.size());
      texts_[path] += text;
      return;
    }
    texts_[path] += frame.payload + "\n";
  }

  /// The truth, and what the robot could sense of it at most.
  void observe(const Message& message) {
    ScanInfo info;
    Event event;
    if (message.channel == channel::kMrWorld && decode(message.channel, message.payload, world_)) look();
    if (message.channel == channel::kMrScanInfo && decode(message.channel, message.payload, info)) {
      for (const std::int16_t agent : info.beam_agent)
        if (agent >= 0) sensed_.insert(info.agents[static_cast<std::size_t>(agent)]);
    }
    if (message.channel == channel::kMrEvents && decode(message.channel, message.payload, event) &&
        event.kind == EventKind::contact_started)
      sensed_.insert({event.subject, event.object});
  }
  void look() {
    const std::string& robot = configuration_.robot.name;
    std::optional<Transform<Map, Base>> T_map_base;
    for (const WorldMessage::Entry& body : world_.bodies)
      if (body.entity == robot && !T_map_base) T_map_base = simulation::base_of(body.T_map_body);
    for (const WorldMessage::Entry& body : world_.bodies) {
      if (body.owner != BodyOwner::agent) continue;
      track_[body.entity].push_back(body.T_map_body.translation().head<2>());
      if (T_map_base && could_see(*T_map_base, body)) sensed_.insert(body.entity);
    }
  }
  /// Whether a point of a box about the body is in the picture, and not behind the building.
  bool could_see(const Transform<Map, Base>& T_map_base, const WorldMessage::Entry& body) const {
    const auto& camera = configuration_.robot.camera;
    if (!camera) return false;
    const auto T_map_optical = T_map_base * camera->T_base_optical;
    for (int i = 0; i < 125; ++i) {
      const Eigen::Vector3d offset(0.25 * (i % 5 - 2), 0.25 * (i / 5 % 5 - 2), 0.05 + 0.4 * (i / 25));
      const Eigen::Vector3d point = body.T_map_body.translation() + offset;
      const Eigen::Vector3d p = T_map_optical.inverse() * point;
      const auto& lens = camera->intrinsics;
      if (p.z() <= 0 || std::abs(lens.fx * p.x() / p.z() + lens.cx - lens.width / 2.0) > lens.width / 2.0 ||
          std::abs(lens.fy * p.y() / p.z() + lens.cy - lens.height / 2.0) > lens.height / 2.0)
        continue;
      const auto& parts = configuration_.model.entities;
      const bool hidden = std::any_of(parts.begin(), parts.end(), [&](const ModelEntity& part) {
        return is_solid(part) && part.label != EntityLabel::floor && part.label != EntityLabel::door &&
               line_in_box(part.T_map_body, part.size, T_map_optical.translation(), point) > 0;
      });
      if (!hidden) return true;
    }
    return false;
  }

  /// Names that are not told in the briefing and of nothing that was sensed.
  std::set<std::string> secret_names(const std::string& briefing) const {
    const Scenario& scenario = configuration_.scenario;
    std::set<std::string> names;
    for (const auto& [agent, track] : track_) names.insert(agent);
    for (const AgentDefinition& agent : scenario.agents) names.insert(agent.name);
    for (const Zone& zone : scenario.zones) names.insert(zone.name);
    for (const Hazard& hazard : scenario.hazards) names.insert(hazard.name);
    for (const Script& script : scenario.scripts) {
      names.insert(script.name);
      for (const AgentCommand& action : script.actions)
        names.insert(subject_of(to_instructor_command(action)));
    }
    for (const ModelEntity& part : configuration_.model.entities) names.erase(part.name);
    std::erase_if(names, [&](const std::string& name) {
      return name.empty() || has_name(briefing, name) || sensed_.contains(name) ||
             configuration_.find_robot(name);
    });
    return names;
  }
  /// Where agents that were never sensed have been, and are to go.
  std::vector<std::pair<std::string, Eigen::Vector2d>> secret_places() const {
    std::vector<std::pair<std::string, Eigen::Vector2d>> places;
    for (const auto& [agent, track] : track_)
      if (!sensed_.contains(agent) && !configuration_.find_robot(agent))
        for (std::size_t i = 0; i < track.size(); i += 10) places.emplace_back(agent, track[i]);
    for (const AgentDefinition& agent : configuration_.scenario.agents)
      if (!sensed_.contains(agent.name))
        for (const Eigen::Vector2d& waypoint : agent.behaviour.waypoints)
          places.emplace_back(agent.name + "'s waypoint", waypoint);
    return places;
  }

  const Role role_;
  test::TemporaryFolder folder_;
  tick::Configuration configuration_ = test::configuration({});
  MemoryBusHub hub_;
  std::unique_ptr<Bus> server_bus_ = hub_.connect(), witness_ = hub_.connect();
  std::map<std::string, std::unique_ptr<Listener>> listeners_;
  std::map<std::string, std::string> texts_;                    // by path: all that was received
  std::map<std::string, std::vector<Eigen::Vector2d>> places_;  // by path
  WorldMessage world_;
  std::map<std::string, std::vector<Eigen::Vector2d>> track_;  // by agent
  std::set<std::string> sensed_;                               // at most
};

class FairToTraineesIn : public ::testing::TestWithParam<std::string> {};

TEST_P(FairToTraineesIn, NoByteIsAboutWhatWasNotSensed) {
  FairSession session(GetParam(), Role::trainee);
  session.run(1.5);
  EXPECT_GT(session.received(), 10'000U);
  EXPECT_THAT(session.leaks(), ::testing::IsEmpty());
}

std::vector<std::string> shipped_scenarios() {
  std::vector<std::string> all;
  for (const char* folder : {"", "programmes", "lanes"}) {
    for (const auto& entry : std::filesystem::directory_iterator(kScenarios + folder)) {
      if (entry.path().extension() != ".yaml") continue;
      const std::string text = test::bytes_of(entry.path());
      if (text.find("\ntraining:") != std::string::npos)
        all.push_back(std::filesystem::relative(entry.path(), kScenarios).string());
    }
  }
  std::sort(all.begin(), all.end());
  return all;
}

INSTANTIATE_TEST_SUITE_P(Shipped, FairToTraineesIn, ::testing::ValuesIn(shipped_scenarios()),
                         [](const auto& each) {
                           return std::regex_replace(each.param, std::regex("[^A-Za-z0-9]+"), "_");
                         });

TEST(FairToTrainees, AnInstructorIsSentWhatTheSearchLooksFor) {
  using ::testing::Contains;
  using ::testing::StartsWith;
  FairSession hidden("programmes/find_and_report.yaml", Role::instructor);
  hidden.run(1.5);
  EXPECT_THAT(hidden.leaks(), Contains(StartsWith("place on /ws/state: barrel_1")));
}

}  // namespace
}  // namespace parhelion::station

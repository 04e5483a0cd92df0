#include "protocols/authentication/keys.hpp"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <set>

#include "protocols/bus/channel_pattern.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/yaml/base64.hpp"
#include "protocols/yaml/quantity.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {
namespace {

constexpr off_t kMaxFile = off_t{1} << 20;  // bytes

struct Role {
  const char* name;
  std::vector<std::string> channels;
};

const std::vector<Role>& roles() {
  using namespace channel;
  static const std::vector<std::string> sensors{kRobot,  kScan,  kLines, kOdometry,
                                                kCamera, kDepth, kImu,   kJointState};
  static const std::vector<Role> all = [] {
    std::vector<std::string> server{kLoop,
                                    kMrScan,
                                    kMrScanInfo,
                                    kMrCamera,
                                    kMrDepth,
                                    kMrSession,
                                    kMrModel,
                                    kMrWorld,
                                    kMrEvents,
                                    kMrStatus,
                                    kMrCmd,
                                    kMrJointCmd,
                                    kPoseCov,
                                    kPose,
                                    kBumper,
                                    kHazard,
                                    "MR_AGENT_.*_SCAN",
                                    "MR_AGENT_.*_CAMERA"};
    server.insert(server.begin(), sensors.begin(), sensors.end());  // levels 1 and 2 simulate the robot
    return std::vector<Role>{{"robot", sensors},
                             {"localization", {kPoseCov, kPose}},
                             {"trainee",
                              {kTeleop, kJointCmd, kOperators, kMrObjectReport, kMrEmergencyStop,
                               "MR_AGENT_.*_TELEOP", "MR_AGENT_.*_JOINT_CMD"}},
                             {"instructor",
                              {kMrSpawn, kMrMove, kMrBehaviour, kMrRemove, kMrFreeze, kMrDoor, kMrFault,
                               kMrCameraRate, kMrScript, kMrStart, kMrEmergencyStop, kMrObjectReport,
                               kOperators, "MR_AGENT_.*_TELEOP", "MR_AGENT_.*_JOINT_CMD"}},
                             {"server", std::move(server)}};
  }();
  return all;
}

/// Zeros, with a problem added, where the text is not the base64 of 32 bytes.
Secret read_secret(const yaml::Node& map, yaml::Problems& problems) {
  const yaml::Node& text = *map.find("secret");
  Secret secret{};
  const auto bytes = yaml::from_base64(text.text);
  if (bytes && bytes->size() == secret.size()) {
    std::copy(bytes->begin(), bytes->end(), secret.begin());
  } else {
    problems.add(text.line, "secret: expected 44 characters of base64, as `parhelion key new` writes them");
  }
  return secret;
}

std::vector<std::string> read_list(const yaml::Node& map, const char* key) {
  std::vector<std::string> words;
  if (const yaml::Node* list = map.find(key)) {
    for (const yaml::Node& item : list->items) words.push_back(item.text);
  }
  return words;
}

Sender read_sender(const yaml::Node& map, yaml::Problems& problems) {
  Sender sender{map.find("name")->text, read_secret(map, problems), read_list(map, "roles"),
                read_list(map, "channels")};
  if (sender.roles.empty() && sender.channels.empty())
    problems.add(map.line, "sender '" + sender.name + "': expected roles or channels");
  for (const std::string& pattern : sender.channels) {
    if (const auto made = make_pattern(pattern); !made) problems.add(map.line, made.error().message);
  }
  return sender;
}

void write_secret(yaml::Writer& writer, const Secret& secret) {
  writer.line("secret", "\"" + yaml::to_base64(secret) + "\"");
}

}  // namespace

Secret new_secret() {
  Secret secret;
  if (sodium_init() < 0) std::abort();  // without random numbers nothing is secret
  randombytes_buf(secret.data(), secret.size());
  return secret;
}

const std::vector<std::string>& sender_roles() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Role& role : roles()) all.emplace_back(role.name);
    return all;
  }();
  return names;
}

std::optional<std::vector<std::string>> channels_of_role(std::string_view role) {
  for (const Role& each : roles()) {
    if (each.name == role) return each.channels;
  }
  return std::nullopt;
}

Result<Keys> parse_keys(const std::string& text, const std::string& origin) {
  const auto document = yaml::read_checked(text, origin, "keys");
  if (!document) return document.error();
  yaml::Problems problems(origin);
  Keys keys;
  keys.name = document->find("name")->text;
  keys.secret = read_secret(*document, problems);
  if (const yaml::Node* clock = document->find("clock")) keys.clock = seconds(clock->number);
  std::set<std::string> names{keys.name};
  if (const yaml::Node* list = document->find("senders")) {
    for (const yaml::Node& item : list->items) {
      keys.senders.push_back(read_sender(item, problems));
      if (!names.insert(keys.senders.back().name).second)
        problems.add(item.line, "sender '" + keys.senders.back().name + "': the name occurs twice");
    }
  }
  if (!problems.empty()) return problems.error();
  return keys;
}

Result<Keys> load_keys(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) {
    return Error{path + ": keys cannot be read: " + std::strerror(errno) +
                 "; `parhelion key new` writes such a file, and a link is not followed"};
  }
  struct Closed {
    int file;
    ~Closed() { close(file); }
  } closed{file};
  struct stat about {};
  if (fstat(file, &about) != 0 || !S_ISREG(about.st_mode) || about.st_size > kMaxFile)
    return Error{path + ": expected a file of keys of at most 1 MiB"};
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return Error{path + ": other users may read or change these keys; run: chmod 600 " + path};
  std::string text(static_cast<std::size_t>(about.st_size), '\0');
  if (read(file, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    return Error{path + ": keys cannot be read whole"};
  return parse_keys(text, path);
}

std::string to_yaml(const Keys& keys) {
  yaml::Writer writer;
  writer.text("name", keys.name);
  write_secret(writer, keys.secret);
  writer.quantity("clock", keys.clock.seconds(), yaml::Quantity::time);
  if (keys.senders.empty()) return writer.take();
  writer.open("senders");
  for (const Sender& sender : keys.senders) {
    writer.begin_item();
    writer.text("name", sender.name);
    writer.texts("roles", sender.roles);
    writer.texts("channels", sender.channels);
    write_secret(writer, sender.secret);
    writer.end_item();
  }
  writer.close();
  return writer.take();
}

}  // namespace parhelion

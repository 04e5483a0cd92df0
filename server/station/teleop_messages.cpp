#include "server/station/teleop_messages.hpp"

#include <array>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>

namespace parhelion::station {
namespace {

using Json = nlohmann::json;
using Kind = TeleopRequest::Kind;

constexpr std::size_t kLongest = 4096;    // bytes of a message
constexpr std::size_t kMaxJoints = 64;    // per message
constexpr std::size_t kLongestName = 64;  // bytes
constexpr double kMaxMs = 4e12;           // ms of a clock that fit in 64 bits as nanoseconds
constexpr double kMaxCount = 9e15;        // largest integer that a double represents exactly

struct KeysOfKind {
  const char* word;
  Kind kind;
  std::vector<const char*> needed, allowed;
};

const std::array<KeysOfKind, 6>& kinds() {
  static const std::array<KeysOfKind, 6> all{{
      {"drive", Kind::drive, {"robot"}, {}},
      {"twist", Kind::twist, {"seq", "at_ms", "vx", "vy", "wz"}, {}},
      {"release", Kind::release, {}, {}},
      {"joints", Kind::joints, {"seq", "at_ms", "names", "velocities"}, {}},
      {"stop", Kind::stop, {}, {"robot"}},
      {"ping", Kind::ping, {"at_ms"}, {"pong_us", "pong_received_at_ms"}},
  }};
  return all;
}

Error expected(const std::string& key, const std::string& what) {
  return Error{"'" + key + "': expected " + what};
}

/// Reads the keys of one message; keeps the first error.
class Keys {
 public:
  explicit Keys(const Json& message) : message_(message) {}

  double number(const char* key, double max_value) {
    const auto found = message_.find(key);
    if (found == message_.end()) return 0;
    const double value = found->is_number() ? found->get<double>() : std::nan("");
    if (std::isfinite(value) && std::abs(value) <= max_value) return value;
    fail(expected(key, "a number of at most " + std::to_string(static_cast<std::int64_t>(max_value))));
    return 0;
  }
  std::uint64_t count(const char* key) {
    const double value = number(key, kMaxCount);
    if (value >= 0 && value == std::floor(value)) return static_cast<std::uint64_t>(value);
    fail(expected(key, "a whole number, 0 or more"));
    return 0;
  }
  std::string name(const char* key) {
    const auto found = message_.find(key);
    return found == message_.end() ? "" : name_in(*found, key);
  }
  std::vector<std::string> names(const char* key) {
    std::vector<std::string> all;
    for (const Json& each : list(key)) all.push_back(name_in(each, key));
    return all;
  }
  std::vector<double> numbers(const char* key, double max_value) {
    std::vector<double> all;
    for (const Json& each : list(key)) {
      const double value = each.is_number() ? each.get<double>() : std::nan("");
      if (!(std::abs(value) <= max_value)) fail(expected(key, "a list of numbers"));
      all.push_back(value);
    }
    return all;
  }
  bool has(const char* key) const { return message_.contains(key); }
  void fail(Error error) {
    if (fault_.ok()) fault_ = std::move(error);
  }
  const Status& fault() const { return fault_; }

 private:
  std::string name_in(const Json& value, const char* key) {
    if (value.is_string() && value.get_ref<const std::string&>().size() <= kLongestName)
      return value.get<std::string>();
    fail(expected(key, "a name of at most 64 bytes"));
    return "";
  }
  const Json& list(const char* key) {
    static const Json none = Json::array();
    const Json& value = message_.at(key);
    if (value.is_array() && !value.empty() && value.size() <= kMaxJoints) return value;
    fail(expected(key, "a list of 1 to 64 joints"));
    return none;
  }

  const Json& message_;
  Status fault_;
};

Status check_keys(const Json& message, const KeysOfKind& kind) {
  for (const char* key : kind.needed) {
    if (!message.contains(key)) return Error{std::string("'") + kind.word + "' lacks '" + key + "'"};
  }
  const auto is_among = [](const std::string& key, const std::vector<const char*>& keys) {
    for (const char* each : keys) {
      if (key == each) return true;
    }
    return false;
  };
  for (const auto& [key, value] : message.items()) {
    if (key != "type" && !is_among(key, kind.needed) && !is_among(key, kind.allowed))
      return Error{"'" + key.substr(0, kLongestName) + "' is not a key of '" + kind.word + "'"};
  }
  return {};
}

Duration milliseconds_of(double ms) { return Duration{static_cast<std::int64_t>(ms * 1e6)}; }

std::string dump(const Json& message) { return message.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

Result<TeleopRequest> read_teleop_request(std::string_view text) {
  if (text.size() > kLongest) return Error{"a message of more than 4096 bytes"};
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object()) return Error{"expected a JSON object with a \"type\""};
  const auto type = message.find("type");
  const KeysOfKind* kind = nullptr;
  for (const KeysOfKind& each : kinds()) {
    if (type != message.end() && *type == each.word) kind = &each;
  }
  if (kind == nullptr) return expected("type", "drive, twist, release, joints, stop or ping");
  if (Status fits = check_keys(message, *kind); !fits) return fits.error();
  Keys keys(message);
  TeleopRequest request;
  request.kind = kind->kind;
  request.robot = keys.name("robot");
  request.stamp = {keys.count("seq"), milliseconds_of(keys.number("at_ms", kMaxMs))};
  request.twist = {keys.number("vx", 1e3), keys.number("vy", 1e3), keys.number("wz", 1e3)};
  if (request.kind == Kind::joints) {
    request.names = keys.names("names");
    request.velocities = keys.numbers("velocities", 1e3);
    if (request.names.size() != request.velocities.size())
      keys.fail(expected("velocities", "one for each of 'names'"));
  }
  if (keys.has("pong_us") != keys.has("pong_received_at_ms"))
    keys.fail(expected("pong_us", "together with 'pong_received_at_ms'"));
  if (keys.has("pong_us")) request.pong_us = static_cast<std::int64_t>(keys.number("pong_us", kMaxCount));
  request.pong_received_at = milliseconds_of(keys.number("pong_received_at_ms", kMaxMs));
  if (!keys.fault()) return keys.fault().error();
  return request;
}

std::string robots_text(const std::vector<TeleopRobot>& robots) {
  Json list = Json::array();
  for (const TeleopRobot& robot : robots) {
    Json joints = Json::array();
    for (const TeleopJoint& joint : robot.joints)
      joints.push_back({{"name", joint.name},
                        {"kind", joint.kind},
                        {"lower", joint.lower},
                        {"upper", joint.upper},
                        {"speed", joint.speed}});
    Json words({{"name", robot.driven.name},
                {"joints", std::move(joints)},
                {"max", {{"vx", robot.vx}, {"vy", robot.vy}, {"wz", robot.wz}}},
                {"video", robot.video}});
    if (!robot.why_not.empty()) words.update({{"drivable", false}, {"why", robot.why_not}});
    list.push_back(std::move(words));
  }
  return dump({{"type", "robots"}, {"list", std::move(list)}});
}

std::string driven_text(const std::string& robot, const std::string& by, bool you, bool silent) {
  Json words({{"type", "driven"}, {"robot", robot}, {"by", by}, {"you", you}});
  if (silent) words["silent"] = true;
  return dump(words);
}

std::string sent_text(const ClientStamp& stamp) {
  return dump({{"type", "sent"}, {"seq", stamp.sequence}, {"at_ms", stamp.at.seconds() * 1e3}});
}

std::string refused_text(const std::string& why, bool rearm) {
  return dump({{"type", "refused"}, {"text", why}, {"rearm", rearm}});
}

std::string estop_text(const std::string& robot, const std::string& by, bool on) {
  return dump({{"type", "estop"}, {"robot", robot}, {"on", on}, {"by", by}});
}

std::string pong_text(Duration at, std::int64_t server_us) {
  return dump({{"type", "pong"}, {"at_ms", at.seconds() * 1e3}, {"server_us", server_us}});
}

}  // namespace parhelion::station

// operator_t, event_t, world_t.
#include <utility>

#include "parhelion/event_t.hpp"
#include "parhelion/operator_t.hpp"
#include "parhelion/world_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxBodies = 100'000;
constexpr std::size_t kMinBodySize = 2 * 5 + 2 + 8 + 13 * sizeof(double) + 1;
constexpr std::size_t kMaxPersons = 10'000;
constexpr std::size_t kMinPersonSize = 5 + 5 * sizeof(double);
constexpr double kMaxVariance = 1e4;  // m^2

void decode_person(wire::Reader& reader, WorldMessage::Person& person) {
  reader.text("entity", person.entity);
  person.radius = reader.bounded("radius", 10);
  const double xx = reader.bounded("covariance", kMaxVariance);
  const double xy = reader.bounded("covariance", kMaxVariance);
  const double yy = reader.bounded("covariance", kMaxVariance);
  reader.check(person.radius >= 0, "radius", "a negative radius", "0 to 10 m");
  reader.check(xx >= 0 && yy >= 0, "covariance", "a negative variance", "a covariance matrix");
  person.covariance << xx, xy, xy, yy;
  person.seen.ns = reader.utime().ns;
}

void encode_person(const WorldMessage::Person& person, wire::Writer& writer) {
  writer.text(person.entity);
  writer.number(person.radius);
  for (const double value : {person.covariance(0, 0), person.covariance(0, 1), person.covariance(1, 1)})
    writer.number(value);
  writer.number(SensorTime{person.seen.ns}.utime());
}

}  // namespace

Status decode(std::string_view channel, Bytes bytes, OperatorStatus& status) {
  wire::Reader reader(channel, "operator_t", operator_t::getHash(), bytes);
  status.stamp = reader.utime();
  reader.text("name", status.name);
  static_assert(kMaxOperatorName == 40);
  reader.check(wire::is_operator_name(status.name), "name", "an invalid operator name",
               "1 to 40 letters, digits, '_' and '-'");
  reader.text("robot", status.robot);
  if (!status.robot.empty()) wire::check_agent_name(reader, "robot", status.robot);
  status.state = reader.enumeration("state", OperatorStatus::State::lost);
  if (status.state == OperatorStatus::State::drives) {
    reader.name("text", status.text);
  } else {  // a release counts whatever its text is
    reader.text("text", status.text);
    status.text = wire::clipped(std::move(status.text));
  }
  return reader.status();
}

void encode(const OperatorStatus& status, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(operator_t::getHash(), bytes);
  writer.number(status.stamp.utime());
  writer.text(status.name);
  writer.text(status.robot);
  writer.enumeration(status.state);
  writer.text(status.text);
}

Status decode(std::string_view channel, Bytes bytes, Event& event) {
  wire::Reader reader(channel, "event_t", event_t::getHash(), bytes);
  event.stamp.ns = reader.nanosecond_stamp();
  event.kind = reader.enumeration("kind", kLastEventKind);
  reader.text("subject", event.subject);
  reader.text("object", event.object);
  event.pair = reader.enumeration("pair", PairKind::virtual_virtual);
  event.position = reader.vector("position", wire::kMaxPosition);
  event.impulse = reader.bounded("impulse", 1e12);
  event.value = reader.bounded("value", 1e12);
  event.undetectable = reader.boolean("undetectable");
  event.request = static_cast<std::uint64_t>(reader.number<std::int64_t>("request"));
  reader.text("text", event.text);
  return reader.status();
}

void encode(const Event& event, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(event_t::getHash(), bytes);
  writer.nanosecond_stamp(event.stamp);
  writer.enumeration(event.kind);
  writer.text(event.subject);
  writer.text(event.object);
  writer.enumeration(event.pair);
  writer.vector(event.position);
  writer.number(event.impulse);
  writer.number(event.value);
  writer.boolean(event.undetectable);
  writer.number(static_cast<std::int64_t>(event.request));
  writer.text(event.text);
}

Status decode(std::string_view channel, Bytes bytes, WorldMessage& world) {
  wire::Reader reader(channel, "world_t", world_t::getHash(), bytes);
  world.stamp.ns = reader.nanosecond_stamp();
  world.step = static_cast<std::uint64_t>(reader.number<std::int64_t>("step"));
  reader.text("robot", world.robot);
  world.bodies.resize(reader.count("nbodies", kMinBodySize, kMaxBodies));
  for (WorldMessage::Entry& body : world.bodies) {
    reader.text("entity", body.entity);
    reader.text("part", body.part);
    body.kind = reader.enumeration("kind", kLastAgentKind);
    body.owner = reader.enumeration("owner", kLastBodyOwner);
    const auto epoch = reader.number<std::int64_t>("epoch");
    reader.check_range("epoch", epoch, 0, UINT32_MAX);
    body.epoch = static_cast<std::uint32_t>(epoch);
    const Eigen::Vector3d position = reader.vector("pos", wire::kMaxPosition);
    body.T_map_body = {reader.orientation("orientation"), position};
    body.velocity = reader.vector("velocity", wire::kMaxRate);
    body.rotation_rate = reader.vector("rotation_rate", wire::kMaxRate);
    body.attitude_known = reader.boolean("attitude_known");
  }
  world.persons.resize(reader.count("npersons", kMinPersonSize, kMaxPersons));
  for (WorldMessage::Person& person : world.persons) decode_person(reader, person);
  return reader.status();
}

void encode(const WorldMessage& world, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(world_t::getHash(), bytes);
  writer.nanosecond_stamp(world.stamp);
  writer.number(static_cast<std::int64_t>(world.step));
  writer.text(world.robot);
  writer.count(world.bodies.size());
  for (const WorldMessage::Entry& body : world.bodies) {
    writer.text(body.entity);
    writer.text(body.part);
    writer.enumeration(body.kind);
    writer.enumeration(body.owner);
    writer.number(std::int64_t{body.epoch});
    writer.vector(body.T_map_body.translation());
    writer.orientation(body.T_map_body.quaternion());
    writer.vector(body.velocity);
    writer.vector(body.rotation_rate);
    writer.boolean(body.attitude_known);
  }
  writer.count(world.persons.size());
  for (const WorldMessage::Person& person : world.persons) encode_person(person, writer);
}

}  // namespace parhelion

// robot_t, session_t, loop_t, model_t, status_t.
#include "parhelion/loop_t.hpp"
#include "parhelion/model_t.hpp"
#include "parhelion/robot_t.hpp"
#include "parhelion/session_t.hpp"
#include "parhelion/status_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxEntries = 10'000;
constexpr std::size_t kStringSize = 5;  // minimum: its length and its NUL

}  // namespace

Status decode(std::string_view channel, Bytes bytes, RobotMessage& message) {
  wire::Reader reader(channel, "robot_t", robot_t::getHash(), bytes);
  message.stamp = reader.utime();
  reader.text("yaml", message.yaml);
  return reader.status();
}

void encode(const RobotMessage& message, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(robot_t::getHash(), bytes);
  writer.number(message.stamp.utime());
  writer.text(message.yaml);
}

Status decode(std::string_view channel, Bytes bytes, SessionHeader& header) {
  wire::Reader reader(channel, "session_t", session_t::getHash(), bytes);
  header.stamp = reader.utime();
  reader.text("scenario_yaml", header.scenario_yaml);
  reader.text("model_yaml", header.model_yaml);
  reader.raw("map", reader.count("map_size", 1, INT32_MAX), header.map);
  reader.text("robot_yaml", header.robot_yaml);
  header.seed = static_cast<std::uint64_t>(reader.number<std::int64_t>("seed"));
  reader.text("version", header.version);
  header.input_channels.resize(reader.count("ninputs", kStringSize, kMaxEntries));
  for (std::string& name : header.input_channels) reader.text("input_channels", name);
  header.robot_models.resize(reader.count("nrobot_models", 3 * kStringSize, kMaxEntries));
  for (RobotModelTexts& model : header.robot_models) reader.text("robot_model_names", model.name);
  for (RobotModelTexts& model : header.robot_models) reader.text("robot_model_urdfs", model.urdf);
  for (RobotModelTexts& model : header.robot_models) reader.text("robot_model_yamls", model.yaml);
  return reader.status();
}

void encode(const SessionHeader& header, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(session_t::getHash(), bytes);
  writer.number(header.stamp.utime());
  writer.text(header.scenario_yaml);
  writer.text(header.model_yaml);
  writer.count(header.map.size());
  writer.raw(header.map);
  writer.text(header.robot_yaml);
  writer.number(static_cast<std::int64_t>(header.seed));
  writer.text(header.version);
  writer.count(header.input_channels.size());
  for (const std::string& name : header.input_channels) writer.text(name);
  writer.count(header.robot_models.size());
  for (const RobotModelTexts& model : header.robot_models) writer.text(model.name);
  for (const RobotModelTexts& model : header.robot_models) writer.text(model.urdf);
  for (const RobotModelTexts& model : header.robot_models) writer.text(model.yaml);
}

Status decode(std::string_view channel, Bytes bytes, LoopDecision& decision) {
  wire::Reader reader(channel, "loop_t", loop_t::getHash(), bytes);
  decision.stamp = reader.utime();
  decision.kind = reader.enumeration("kind", LoopDecision::Kind::late_command);
  decision.count = reader.number<std::int64_t>("count");
  if (decision.kind != LoopDecision::Kind::late_command)
    reader.check_range("count", decision.count, 0, INT64_MAX);
  return reader.status();
}

void encode(const LoopDecision& decision, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(loop_t::getHash(), bytes);
  writer.number(decision.stamp.utime());
  writer.enumeration(decision.kind);
  writer.number(decision.count);
}

Status decode(std::string_view channel, Bytes bytes, ModelVersion& model) {
  wire::Reader reader(channel, "model_t", model_t::getHash(), bytes);
  model.stamp = reader.utime();
  const auto version = reader.number<std::int64_t>("version");
  reader.check_range("version", version, 1, INT64_MAX);
  model.version = static_cast<std::uint64_t>(version);
  reader.text("yaml", model.yaml);
  return reader.status();
}

void encode(const ModelVersion& model, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(model_t::getHash(), bytes);
  writer.number(model.stamp.utime());
  writer.number(static_cast<std::int64_t>(model.version));
  writer.text(model.yaml);
}

Status decode(std::string_view channel, Bytes bytes, ServerStatus& status) {
  wire::Reader reader(channel, "status_t", status_t::getHash(), bytes);
  status.stamp = reader.utime();
  status.values.resize(reader.count("nvalues", kStringSize + sizeof(double), kMaxEntries));
  for (auto& [name, value] : status.values) reader.text("value_names", name);
  for (auto& [name, value] : status.values) value = reader.number<double>("values");
  status.notes.resize(reader.count("nnotes", 2 * kStringSize, kMaxEntries));
  for (auto& [name, note] : status.notes) reader.text("note_names", name);
  for (auto& [name, note] : status.notes) reader.text("notes", note);
  return reader.status();
}

void encode(const ServerStatus& status, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(status_t::getHash(), bytes);
  writer.number(status.stamp.utime());
  writer.count(status.values.size());
  for (const auto& [name, value] : status.values) writer.text(name);
  for (const auto& [name, value] : status.values) writer.number(value);
  writer.count(status.notes.size());
  for (const auto& [name, note] : status.notes) writer.text(name);
  for (const auto& [name, note] : status.notes) writer.text(note);
}

}  // namespace parhelion

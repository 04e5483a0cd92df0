#include "server/runtime/session_record.hpp"

#include <algorithm>
#include <filesystem>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/sha256.hpp"

namespace parhelion::runtime {
namespace {

Result<Message> session_message(const std::string& path) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  while (true) {
    auto next = reader->next();
    if (!next) continue;  // damage, counted by the grading
    if (!*next)
      return Error{path + ": no MR_SESSION in it; expected a session log, as serve and replay -o write it"};
    if ((*next)->channel == channel::kMrSession) return std::move(**next);
  }
}

std::string identity_of(const Message& message) {
  Sha256 hash;
  hash.add(message.payload);
  const std::string stamp = std::to_string(message.arrival.ns);
  hash.add({reinterpret_cast<const std::uint8_t*>(stamp.data()), stamp.size()});
  return hash.hex();
}

}  // namespace

Result<std::string> session_identity(const std::string& path) {
  const auto message = session_message(path);
  if (!message) return message.error();
  return identity_of(*message);
}

Result<training::SessionRecord> session_record(
    const std::string& path, const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  const auto message = session_message(path);
  if (!message) return message.error();
  SessionHeader header;
  if (const Status read = decode(message->channel, message->payload, header); !read) return read.error();
  const auto scenario = parse_scenario(header.scenario_yaml, path + ": scenario");
  if (!scenario) return scenario.error();
  auto graded = grade_session(path, progress);
  if (!graded) return graded.error();
  training::SessionRecord record;
  record.identity = identity_of(*message);
  record.scenario = graded->scenario;
  record.robot = graded->robot;
  record.log = std::filesystem::path(path).filename().string();
  record.level = scenario->level;
  record.skipped_bytes = graded->skipped_bytes;
  record.grade = std::move(graded->grade);
  for (const Task& task : scenario->training->tasks) {
    record.skills.push_back(task.skills);
    std::sort(record.skills.back().begin(), record.skills.back().end());
  }
  return record;
}

}  // namespace parhelion::runtime

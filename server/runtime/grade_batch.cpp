#include "server/runtime/grade_batch.hpp"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "protocols/isolation.hpp"
#include "server/training/csv.hpp"

namespace parhelion::runtime {
namespace {

namespace fs = std::filesystem;

Status add_folder(const std::string& folder, std::vector<std::string>& logs) {
  const std::size_t before = logs.size();
  std::error_code failed;
  for (fs::recursive_directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed))
    if (entry->path().extension() == ".lcm" && entry->is_regular_file(failed))
      logs.push_back(entry->path().string());
  if (failed) return Error{folder + ": cannot be read: " + failed.message()};
  if (logs.size() == before) return Error{folder + ": there is no session log (*.lcm) in it"};
  return {};
}

using Json = nlohmann::ordered_json;

/// To the parent process, as bytes that give the same row.
std::string packed(const BatchRow& row) {
  const Json json = {row.log,        row.error,      row.identity, row.scenario,     row.robot,
                     row.grade,      row.level,      row.score,    row.awarded,      row.deducted,
                     row.max,        row.fraction,   row.passed,   row.complete,     row.tasks,
                     row.tasks_done, row.deductions, row.duration, row.skipped_bytes};
  std::string bytes;
  Json::to_cbor(json, bytes);
  return bytes;
}

BatchRow unpacked(const std::string& bytes) {
  const Json json = Json::from_cbor(bytes);
  BatchRow row;
  std::size_t i = 0;
  const auto next = [&](auto& field) { json.at(i++).get_to(field); };
  for (std::string* text : {&row.log, &row.error, &row.identity, &row.scenario, &row.robot, &row.grade})
    next(*text);
  next(row.level);
  for (double* number : {&row.score, &row.awarded, &row.deducted, &row.max, &row.fraction}) next(*number);
  next(row.passed);
  next(row.complete);
  for (std::size_t* count : {&row.tasks, &row.tasks_done, &row.deductions}) next(*count);
  next(row.duration);
  next(row.skipped_bytes);
  return row;
}

BatchRow failed_row(const std::string& log, const std::string& reason) {
  BatchRow row;
  row.log = log;
  row.error = log + ": " + reason;
  return row;
}

ChildLimits limits_for(const std::string& log, const GradeProcess& process) {
  constexpr std::uint64_t bytes_per_second = 2'000'000;
  std::error_code failed;
  const std::uintmax_t size = fs::file_size(log, failed);
  return {process.bytes, process.seconds + (failed ? 0 : size / bytes_per_second)};
}

BatchRow row_from(const std::string& log, const Result<ChildResult>& child, const GradeProcess& process) {
  if (!child) return failed_row(log, child.error().message);
  if (child->end.completed) return unpacked(child->bytes);
  return failed_row(log, "its grading " + describe(child->end, limits_for(log, process)) +
                             "; the log may be damaged: check it with `parhelion validate`");
}

}  // namespace

Result<std::vector<std::string>> session_logs(const std::vector<std::string>& places) {
  std::vector<std::string> logs;
  for (const std::string& place : places) {
    std::error_code ignored;
    if (fs::is_directory(place, ignored)) {
      if (const Status added = add_folder(place, logs); !added) return added.error();
    } else if (fs::exists(place, ignored)) {
      logs.push_back(place);
    } else {
      return Error{place + ": there is no such file or folder"};
    }
  }
  std::sort(logs.begin(), logs.end());
  logs.erase(std::unique(logs.begin(), logs.end()), logs.end());
  return logs;
}

std::vector<std::string> shard_of(const std::vector<std::string>& logs, std::size_t shard,
                                  std::size_t shards) {
  std::vector<std::string> ours;
  for (std::size_t i = shard; i < logs.size(); i += shards) ours.push_back(logs[i]);
  return ours;
}

BatchRow grade_log(const std::string& log) {
  BatchRow row;
  row.log = log;
  const auto session = session_record(log);
  if (!session) {
    row.error = session.error().message;
    return row;
  }
  const training::Grade& grade = session->grade;
  row.identity = session->identity;
  row.scenario = session->scenario;
  row.robot = session->robot;
  row.level = session->level;
  row.grade = grade.grade;
  row.score = grade.score;
  row.awarded = grade.awarded;
  row.deducted = grade.deducted;
  row.max = grade.max;
  row.fraction = grade.fraction;
  row.passed = grade.passed;
  row.complete = grade.complete;
  row.tasks = grade.tasks.size();
  for (const training::TaskGrade& task : grade.tasks)
    row.tasks_done += task.outcome == training::TaskOutcome::done ? 1 : 0;
  row.deductions = grade.deductions.size();
  row.duration = (grade.end - grade.begin).seconds();
  row.skipped_bytes = session->skipped_bytes;
  return row;
}

std::vector<BatchRow> grade_batch(const std::vector<std::string>& logs, unsigned at_once,
                                  const std::function<void(std::size_t, std::size_t)>& progress,
                                  const GradeProcess& process) {
  std::vector<BatchRow> rows(logs.size());
  std::size_t done = 0;
  const auto task = [&](std::size_t i) {
    return ChildTask{limits_for(logs[i], process),
                     [&, i](const auto&) { return packed(process.grade(logs[i])); }};
  };
  results_of_children(logs.size(), at_once, task, [&](std::size_t i, const auto& child) {
    rows[i] = row_from(logs[i], child, process);
    if (progress) progress(++done, logs.size());
  });
  return rows;
}

std::string to_csv(const std::vector<BatchRow>& rows) {
  std::string text =
      "log,error,identity,scenario,level,robot,score,awarded,deducted,max,fraction,grade,passed,complete,"
      "tasks,"
      "tasks_done,deductions,duration_s,skipped_bytes\r\n";
  for (const BatchRow& row : rows) {
    text += training::csv_field(row.log) + "," + training::csv_field(row.error);
    if (!row.error.empty()) {
      text += std::string(17, ',') + "\r\n";
      continue;
    }
    for (const std::string& field : {row.identity, row.scenario, std::to_string(row.level), row.robot})
      text += "," + training::csv_field(field);
    for (const double number : {row.score, row.awarded, row.deducted, row.max, row.fraction})
      text += "," + training::csv_number(number);
    text += "," + training::csv_field(row.grade) + (row.passed ? ",1" : ",0") + (row.complete ? ",1" : ",0");
    for (const std::size_t number : {row.tasks, row.tasks_done, row.deductions})
      text += "," + std::to_string(number);
    text += "," + training::csv_number(row.duration) + "," + std::to_string(row.skipped_bytes) + "\r\n";
  }
  return text;
}

std::string to_json(const std::vector<BatchRow>& rows) {
  Json json = Json::array();
  for (const BatchRow& row : rows) {
    if (!row.error.empty()) {
      json.push_back({{"log", row.log}, {"error", row.error}});
      continue;
    }
    json.push_back({{"log", row.log},
                    {"identity", row.identity},
                    {"scenario", row.scenario},
                    {"level", row.level},
                    {"robot", row.robot},
                    {"score", row.score},
                    {"awarded", row.awarded},
                    {"deducted", row.deducted},
                    {"max", row.max},
                    {"fraction", row.fraction},
                    {"grade", row.grade},
                    {"passed", row.passed},
                    {"complete", row.complete},
                    {"tasks", row.tasks},
                    {"tasks_done", row.tasks_done},
                    {"deductions", row.deductions},
                    {"duration_s", row.duration},
                    {"skipped_bytes", row.skipped_bytes}});
  }
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace parhelion::runtime

#include "server/runtime/play/recording.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <utility>

#include "protocols/bus/log_file.hpp"
#include "protocols/bus/log_format.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/play/play_times.hpp"
#include "server/tick/instructor_input.hpp"

namespace parhelion::runtime {
namespace {

struct Entry {
  std::uint64_t offset = 0;  ///< of the payload
  std::int64_t arrival = 0;  ///< ns
  std::int64_t t = 0;        ///< ns since the session's start, does not decrease
  std::uint32_t size = 0;
  std::uint16_t channel = 0;
};

/// Messages of one channel.
struct Channel {
  std::string name;
  bool adds_up = false;  ///< every message counts, not only the newest
  std::vector<std::size_t> entries;
};

bool is_bad(EventKind kind) {
  switch (kind) {
    case EventKind::contact_started:
    case EventKind::points_deducted:
    case EventKind::task_failed:
    case EventKind::fell:
    case EventKind::tipped_over:
    case EventKind::dropped:
    case EventKind::hazard_triggered:
    case EventKind::joint_broken:
    case EventKind::localization_lost:
      return true;
    default:
      return false;
  }
}

bool is_marked(EventKind kind) {
  switch (kind) {
    case EventKind::task_started:
    case EventKind::task_done:
    case EventKind::object_reported:
    case EventKind::script_started:
    case EventKind::fault_started:
    case EventKind::grading_ended:
      return true;
    default:
      return is_bad(kind);
  }
}

constexpr std::size_t kMaxFindings = 10;

/// "83.1 years later", "5.0 s earlier".
std::string apart_text(Duration time) {
  constexpr std::pair<double, const char*> units[] = {
      {365.25 * 86400, "years"}, {86400, "days"}, {3600, "h"}, {60, "min"}, {0, "s"}};
  const double s = std::abs(time.seconds());
  const auto* unit = std::begin(units);
  while (s < unit->first) ++unit;
  char text[40];
  std::snprintf(text, sizeof text, "%.1f %s %s", s / std::max(1.0, unit->first), unit->second,
                time.ns < 0 ? "earlier" : "later");
  return text;
}

}  // namespace

struct Recording::State {
  std::string path;
  int file = -1;
  SessionHeader session;
  std::string events_channel;
  std::vector<std::string> command_channels;
  std::vector<Entry> entries;
  std::vector<Channel> channels;
  std::map<std::string, std::uint16_t, std::less<>> channel_numbers;
  std::vector<RecordedMark> marks;
  std::vector<std::size_t> mark_entries;
  std::uint64_t skipped = 0;
  std::vector<std::string> findings;
  std::size_t more_findings = 0;

  ~State() {
    if (file >= 0) close(file);
  }
  Status begin(const Message& message);
  Status add(const Message& message, std::uint64_t end);
  void place_in_time();
  void find(std::string what);
  bool handle_event(const Message& message);
  std::uint16_t number_of(const std::string& channel);
};

/// Looks up the session's names of the channels of which every message counts.
Status Recording::State::begin(const Message& message) {
  if (message.channel != channel::kMrSession) {
    return Error{path + ": its first message is on " + message.channel +
                 ", expected MR_SESSION: a session log, as serve and replay -o write it" +
                 (findings.empty() ? "" : "; the log is damaged: " + findings.front())};
  }
  if (const Status read = decode(message.channel, message.payload, session); !read) return read;
  const auto scenario = parse_scenario(session.scenario_yaml, path + " (MR_SESSION scenario)");
  if (!scenario) return scenario.error();
  const tick::ChannelMap names(*scenario);
  events_channel = names.bus(channel::kMrEvents);
  command_channels = tick::command_channels(names);
  return {};
}

std::uint16_t Recording::State::number_of(const std::string& name) {
  const auto known = channel_numbers.find(name);
  if (known != channel_numbers.end()) return known->second;
  const auto number = static_cast<std::uint16_t>(channels.size());
  const bool is_command =
      std::find(command_channels.begin(), command_channels.end(), name) != command_channels.end();
  channels.push_back({name, name == events_channel || is_command, {}});
  channel_numbers.emplace(name, number);
  return number;
}

/// Whether it is repeated after a seek.
bool Recording::State::handle_event(const Message& message) {
  Event event;
  if (!decode(message.channel, message.payload, event)) return true;
  if (event.kind == EventKind::contact_continues) return false;
  if (is_marked(event.kind)) {
    std::string text = event.subject;
    if (!event.object.empty()) text += (text.empty() ? "" : ", ") + event.object;
    if (!event.text.empty()) text += (text.empty() ? "" : ": ") + event.text;
    mark_entries.push_back(entries.size() - 1);
    marks.push_back({0, to_string(event.kind), std::move(text), is_bad(event.kind)});
  }
  return true;
}

Status Recording::State::add(const Message& message, std::uint64_t end) {
  if (entries.empty()) {
    if (const Status begun = begin(message); !begun) return begun;
  }
  const std::uint16_t number = number_of(message.channel);
  const auto size = static_cast<std::uint32_t>(message.payload.size());
  entries.push_back({end - size, message.arrival.ns, 0, size, number});
  if (message.channel == events_channel && !handle_event(message)) return {};
  channels[number].entries.push_back(entries.size() - 1);
  return {};
}

void Recording::State::find(std::string what) {
  if (findings.size() < kMaxFindings)
    findings.push_back(std::move(what));
  else
    ++more_findings;
}

void Recording::State::place_in_time() {
  std::vector<std::int64_t> arrivals;
  for (const Entry& entry : entries) arrivals.push_back(entry.arrival);
  const PlayTimes played = play_times(arrivals);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    entries[i].arrival = played.times[i].arrival;
    entries[i].t = played.times[i].t;
  }
  for (std::size_t i = 0; i < marks.size(); ++i)
    marks[i].t = static_cast<double>(entries[mark_entries[i]].t) * 1e-9;
  for (const StampFinding& finding : played.findings) {
    const Entry& entry = entries[finding.message];
    const std::string& name = channels[entry.channel].name;
    const std::uint64_t byte = entry.offset - name.size() - kHeaderSize;
    find(path + ": byte " + std::to_string(byte) + ": " + name + " is stamped " + apart_text(finding.step) +
         " than the message beside it, expected 0 to 60 s later; " +
         (finding.damaged ? "the stamp is damaged: it is played with that message"
                          : "the gap is left out: playing continues at once"));
  }
}

Recording::Recording(std::unique_ptr<State> state) : state_(std::move(state)) {}
Recording::Recording(Recording&&) noexcept = default;
Recording& Recording::operator=(Recording&&) noexcept = default;
Recording::~Recording() = default;

Result<Recording> Recording::open(const std::string& path,
                                  const std::function<bool(std::uint64_t, std::uint64_t)>& progress) {
  auto reader = LogReader::open(path);
  if (!reader) return reader.error();
  auto state = std::make_unique<State>();
  state->path = path;
  state->file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (state->file < 0) return Error{path + ": cannot be opened: " + std::strerror(errno)};
  while (true) {
    const auto next = reader->next();
    if (!next) {
      state->find(next.error().message);
      continue;
    }
    if (!*next) break;
    if (const Status added = state->add(**next, reader->offset()); !added) return added.error();
    if (progress && !progress(reader->offset(), reader->size())) return Error{"stopped"};
  }
  if (state->entries.empty()) {
    const std::string damage =
        state->findings.empty() ? "" : "; the log is damaged: " + state->findings.front();
    return Error{path + ": no message in it; expected a session log" + damage};
  }
  state->place_in_time();
  state->skipped = reader->skipped_bytes();
  return Recording(std::move(state));
}

const SessionHeader& Recording::session() const { return state_->session; }
std::size_t Recording::size() const { return state_->entries.size(); }
ArrivalTime Recording::arrival(std::size_t i) const { return {state_->entries[i].arrival}; }
double Recording::t(std::size_t i) const { return static_cast<double>(state_->entries[i].t) * 1e-9; }
double Recording::duration() const { return t(size() - 1); }
const std::vector<RecordedMark>& Recording::marks() const { return state_->marks; }
std::uint64_t Recording::skipped_bytes() const { return state_->skipped; }
const std::string& Recording::channel(std::size_t i) const {
  return state_->channels[state_->entries[i].channel].name;
}

std::vector<std::string> Recording::findings() const {
  std::vector<std::string> lines = state_->findings;
  if (state_->more_findings > 0) lines.push_back("and " + std::to_string(state_->more_findings) + " more");
  return lines;
}

ArrivalTime Recording::arrival_at(double t) const {
  const Entry& entry = state_->entries[std::max<std::size_t>(1, count_until(t)) - 1];
  return ArrivalTime{entry.arrival} + (seconds(t) - Duration{entry.t});
}

std::size_t Recording::count_until(double t) const {
  const auto& entries = state_->entries;
  const auto end = std::upper_bound(entries.begin(), entries.end(), t, [](double until, const Entry& entry) {
    return until < static_cast<double>(entry.t) * 1e-9;
  });
  return static_cast<std::size_t>(end - entries.begin());
}

Status Recording::read(std::size_t i, Message& message) const {
  const Entry& entry = state_->entries[i];
  message.channel = state_->channels[entry.channel].name;
  message.arrival = {entry.arrival};
  message.payload.resize(entry.size);
  std::size_t done = 0;
  while (done < entry.size) {
    const ssize_t got = pread(state_->file, message.payload.data() + done, entry.size - done,
                              static_cast<off_t>(entry.offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      return Error{state_->path + ": byte " + std::to_string(entry.offset + done) +
                   ": cannot be read: " + (got == 0 ? "the file has become shorter" : std::strerror(errno))};
    }
    done += static_cast<std::size_t>(got);
  }
  return {};
}

std::vector<std::size_t> Recording::news(std::size_t from, std::size_t to) const {
  std::vector<std::size_t> all;
  for (const Channel& channel : state_->channels) {
    const auto first = std::lower_bound(channel.entries.begin(), channel.entries.end(), from);
    const auto end = std::lower_bound(first, channel.entries.end(), to);
    if (first == end) continue;
    all.insert(all.end(), channel.adds_up ? first : end - 1, end);
  }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace parhelion::runtime

#include "tools/import/recording_writer.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include "protocols/arrival_order.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/quantile.hpp"
#include "tools/import/recorded_beams.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kMaxRefusalsListed = 20;
constexpr Duration kMinGap = seconds(1);
constexpr int kGapIntervals = 10;

struct Trail {
  ChannelReport report;
  std::vector<std::pair<SensorTime, Place>> stamps;
};

Duration median_interval(const std::vector<std::pair<SensorTime, Place>>& stamps) {
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i)
    intervals.push_back((stamps[i].first - stamps[i - 1].first).ns);
  if (intervals.empty()) return {};
  return {median(intervals)};
}

std::filesystem::path partial_file(const ImportOptions& options) {
  return options.output.string() + ".partial";
}

std::filesystem::path copy_of(const std::filesystem::path& partial) { return partial.string() + "2"; }

}  // namespace

struct RecordingWriter::State {
  std::filesystem::path partial;
  std::string place_prefix;
  std::optional<LogWriter> log;
  std::optional<RecordedBeams> beams;
  ArrivalOrder order;
  std::vector<Trail> trails;
  std::vector<std::uint8_t> bytes;
  ImportReport report;
  bool finished = false;

  ~State() {
    if (finished || !log) return;
    log.reset();
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
  }

  Trail& trail(std::string_view channel) {
    const auto known = std::find_if(trails.begin(), trails.end(),
                                    [&](const Trail& t) { return t.report.channel == channel; });
    if (known != trails.end()) return *known;
    trails.emplace_back().report.channel = channel;
    return trails.back();
  }

  ArrivalTime next_arrival(ArrivalTime wanted, Place place);
  void judge(Trail& trail) const;
  Status describe_again(const RobotDescription& robot);
};

ArrivalTime RecordingWriter::State::next_arrival(ArrivalTime wanted, Place place) {
  wanted = ArrivalTime::from_utime(wanted.utime());
  const auto last = order.last();
  const auto placed = order.place(wanted);
  const std::string where = place_prefix + std::to_string(place);
  if (placed.verdict == ArrivalOrder::Verdict::ahead) {
    if (report.ahead++ == 0) {
      report.ahead_first = where;
      report.ahead_first_by = wanted - *last;
    }
  } else if (placed.verdict == ArrivalOrder::Verdict::real_leap) {
    // The stamps that confirmed it were correct.
    report.ahead -= ArrivalOrder::kConfirmed - 1;
    if (report.leaps.size() < kMaxRefusalsListed) report.leaps.push_back(where);
  }
  return placed.arrival;
}

void RecordingWriter::State::judge(Trail& trail) const {
  const Duration typical = median_interval(trail.stamps);
  for (std::size_t i = 1; i < trail.stamps.size(); ++i) {
    const Duration step = trail.stamps[i].first - trail.stamps[i - 1].first;
    const std::string place = place_prefix + std::to_string(trail.stamps[i].second);
    if (step < Duration{}) {
      if (trail.report.backward++ == 0) trail.report.backward_first = place;
      trail.report.backward_max = std::max(trail.report.backward_max, -step);
    } else if (step > kMinGap && step.ns > kGapIntervals * typical.ns) {
      ++trail.report.gaps;
      if (step > trail.report.gap_max) {
        trail.report.gap_max = step;
        trail.report.gap_max_place = place;
      }
    }
  }
}

/// Copies the log, with another description in its first event.
Status RecordingWriter::State::describe_again(const RobotDescription& robot) {
  const std::string copy = copy_of(partial).string();
  const auto written = [&]() -> Status {
    auto reader = LogReader::open(partial.string());
    if (!reader) return reader.error();
    auto writer = LogWriter::create(copy, true);
    if (!writer) return writer.error();
    for (;;) {
      auto event = reader->next();
      if (!event) return event.error();
      if (!event->has_value()) return writer->sync();
      Message& message = **event;
      if (message.channel == channel::kRobot) {
        RobotMessage description;
        if (Status read = decode(message.channel, message.payload, description); !read) return read;
        description.yaml = to_yaml(robot);
        encode(description, message.payload);
      }
      if (Status put = writer->write(message.channel, message.arrival, message.payload); !put) return put;
    }
  }();
  std::error_code failed;
  if (written) std::filesystem::rename(copy, partial, failed);
  if (!failed && written) return {};
  std::error_code ignored;
  std::filesystem::remove(copy, ignored);
  return written ? Status(Error{copy + ": cannot be renamed: " + failed.message()}) : written;
}

RecordingWriter::RecordingWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;
RecordingWriter::~RecordingWriter() = default;

void RecordingWriter::remove_unfinished(const ImportOptions& options) {
  std::error_code ignored;
  std::filesystem::remove(partial_file(options), ignored);
  std::filesystem::remove(copy_of(partial_file(options)), ignored);
}

Result<RecordingWriter> RecordingWriter::create(const ImportOptions& options, std::string place_prefix,
                                                std::string read_unit) {
  std::error_code ignored;
  if (!options.overwrite && std::filesystem::exists(options.output, ignored)) {
    return Error{options.output.string() + ": exists already; give another name, or --force to overwrite it"};
  }
  if (std::filesystem::equivalent(options.input, options.output, ignored)) {
    return Error{options.output.string() + ": is the input itself; give another name"};
  }
  auto state = std::make_unique<State>();
  state->partial = partial_file(options);
  state->place_prefix = std::move(place_prefix);
  state->report.input = options.input.string();
  state->report.output = options.output.string();
  state->report.read_unit = std::move(read_unit);
  auto log = LogWriter::create(state->partial.string(), true);
  if (!log) return log.error();
  state->log = std::move(*log);
  return RecordingWriter(std::move(state));
}

Status RecordingWriter::describe(const RobotDescription& robot, SensorTime first) {
  state_->beams.emplace(robot);
  encode(RobotMessage{first, to_yaml(robot)}, state_->bytes);
  // One microsecond early, so that the first event's arrival is its own stamp.
  const ArrivalTime arrival = ArrivalTime::from_utime(first.utime() - 1);
  state_->order.begin_after(arrival);
  return state_->log->write(channel::kRobot, arrival, state_->bytes);
}

template <class T>
Status RecordingWriter::put(std::string_view channel, const T& item, Place place,
                            std::optional<ArrivalTime> received) {
  encode(item, state_->bytes);
  T read_back;
  if (const Status accepted = decode(channel, state_->bytes, read_back); !accepted) {
    refuse(place, accepted.error().message);
    return {};
  }
  const ArrivalTime arrival = state_->next_arrival(received.value_or(ArrivalTime{item.stamp.ns}), place);
  if (Status written = state_->log->write(channel, arrival, state_->bytes); !written) return written;
  Trail& trail = state_->trail(channel);
  ++trail.report.kept;
  trail.stamps.emplace_back(item.stamp, place);
  if constexpr (std::is_same_v<T, Scan>) {
    ++trail.report.beams[item.ranges.size()];
    if (state_->beams) state_->beams->add(channel, item, arrival);
  }
  if constexpr (std::is_same_v<T, Odometry>) {
    if (state_->beams) state_->beams->add(item, arrival);
  }
  return {};
}

template Status RecordingWriter::put(std::string_view, const Scan&, Place, std::optional<ArrivalTime>);
template Status RecordingWriter::put(std::string_view, const Odometry&, Place, std::optional<ArrivalTime>);
template Status RecordingWriter::put(std::string_view, const Image&, Place, std::optional<ArrivalTime>);
template Status RecordingWriter::put(std::string_view, const PoseStamped&, Place, std::optional<ArrivalTime>);
template Status RecordingWriter::put(std::string_view, const PoseEstimate&, Place,
                                     std::optional<ArrivalTime>);
template Status RecordingWriter::put(std::string_view, const TwistCommand&, Place,
                                     std::optional<ArrivalTime>);
template Status RecordingWriter::put(std::string_view, const ImuSample&, Place, std::optional<ArrivalTime>);
template Status RecordingWriter::put(std::string_view, const Joints&, Place, std::optional<ArrivalTime>);

void RecordingWriter::refuse(Place place, std::string why) { refuse_at({place_text(place), std::move(why)}); }

void RecordingWriter::refuse_at(Refusal refusal) {
  ++state_->report.refused;
  // The first places show where to look; of a whole topic the number is enough.
  constexpr std::ptrdiff_t kPlacesOfOneReason = 5;
  std::vector<Refusal>& listed = state_->report.refusals;
  const auto same = [&](const Refusal& other) { return other.why == refusal.why; };
  const auto places = std::count_if(listed.begin(), listed.end(), same);
  if (places >= kPlacesOfOneReason || (places > 0 && listed.size() >= kMaxRefusalsListed))
    ++std::find_if(listed.rbegin(), listed.rend(), same)->more;
  else if (listed.size() < kMaxRefusalsListed)
    listed.push_back(std::move(refusal));
}

void RecordingWriter::refuse_damage(Place place, std::string why) {
  refuse_damage_at({place_text(place), std::move(why)});
}

void RecordingWriter::refuse_damage_at(Refusal refusal) {
  ++state_->report.damaged;
  refuse_at(std::move(refusal));
}

void RecordingWriter::leave_out(const std::string& kind) { ++state_->report.left_out[kind]; }
void RecordingWriter::note(std::string text) { state_->report.notes.push_back(std::move(text)); }
void RecordingWriter::count_read(std::uint64_t n) { state_->report.read += n; }
std::string RecordingWriter::place_text(Place place) const {
  return state_->place_prefix + std::to_string(place);
}

Result<ImportReport> RecordingWriter::finish() {
  for (Trail& trail : state_->trails) {
    state_->judge(trail);
    state_->report.channels.push_back(std::move(trail.report));
  }
  if (state_->report.kept() == 0) {
    std::string why = state_->report.refusals.empty()
                          ? ""
                          : " (first refusal: " + state_->report.refusals[0].place + ": " +
                                state_->report.refusals[0].why + ")";
    return Error{state_->report.input + ": nothing in it could be imported" + why};
  }
  if (const Status synced = state_->log->sync(); !synced) return synced.error();
  if (const auto robot = state_->beams ? state_->beams->corrected(state_->report.notes) : std::nullopt) {
    // What was imported is of use with the other description, too.
    if (const Status described = state_->describe_again(*robot); !described)
      note("the description could not be changed (" + described.error().message +
           "): run parhelion calibrate");
  }
  std::error_code failed;
  std::filesystem::rename(state_->partial, state_->report.output, failed);
  if (failed)
    return Error{state_->report.output +
                 ": the finished recording cannot be renamed to this name: " + failed.message()};
  state_->finished = true;
  return std::move(state_->report);
}

}  // namespace parhelion::tools

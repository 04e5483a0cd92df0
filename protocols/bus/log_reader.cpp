// Reads event logs with read(2) into one buffer. Damage only costs the bytes up to the next sync word.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/bus/log_format.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::uint8_t kSyncBytes[4] = {0xED, 0xA1, 0xDA, 0x01};
constexpr std::size_t kBufferSize = std::size_t{4} << 20;
/// Events up to this size are read together with what follows; a quarter of the buffer, so that a file with
/// wrong event lengths does not cause every byte to be read many times.
constexpr std::uint64_t kPrefetchSize = kBufferSize / 4;
constexpr std::int64_t kMaxChannel = 63;
constexpr std::int64_t kUtimeOf2200 = 7'258'118'400'000'000;

struct Header {
  std::uint32_t sync;
  std::int64_t utime;
  std::int64_t channel_size;
  std::int64_t data_size;

  explicit Header(const std::uint8_t* at)
      : sync(wire::big_endian<std::uint32_t>(at)),
        utime(wire::big_endian<std::int64_t>(at + 12)),
        channel_size(wire::big_endian<std::int32_t>(at + 20)),
        data_size(wire::big_endian<std::int32_t>(at + 24)) {}
  bool sane() const {
    return channel_size >= 1 && channel_size <= kMaxChannel && data_size >= 0 && data_size <= kMaxData;
  }
  std::uint64_t event_size() const {
    return kHeaderSize + static_cast<std::uint64_t>(channel_size + data_size);
  }
};

}  // namespace

struct LogReader::State {
  int file = -1;
  std::string path;
  std::uint64_t size = 0;
  std::uint64_t at = 0;  ///< offset of the next event
  std::uint64_t skipped = 0;
  std::vector<std::uint8_t> buffer;
  std::uint64_t buffer_at = 0;  ///< offset of the buffer's first byte
  std::size_t buffered = 0;

  ~State() {
    if (file >= 0) close(file);
  }

  /// The `n` bytes from `offset` on, or nullptr where they cannot be read; `offset` + `n` is within the file.
  const std::uint8_t* bytes(std::uint64_t offset, std::size_t n);
  /// Offset of the first sync word at or after `from`, or the end of the file.
  Result<std::uint64_t> find_sync(std::uint64_t from, std::uint64_t end);
  /// The event at `at` is invalid because of `why`: skips to the next sync word.
  Error damaged(const std::string& why, std::uint64_t resume_from);
  /// The bytes at `at` cannot be read from disk: no more events follow.
  Error unreadable();
  /// Whether the event is followed by another one or by the end, or at least contains none.
  Result<bool> plausible_end(std::uint64_t event_size);
  Result<std::optional<Message>> next();
};

const std::uint8_t* LogReader::State::bytes(std::uint64_t offset, std::size_t n) {
  if (offset >= buffer_at && offset + n <= buffer_at + buffered) return buffer.data() + (offset - buffer_at);
  const auto wanted =
      static_cast<std::size_t>(std::min<std::uint64_t>(std::max(n, kBufferSize), size - offset));
  if (buffer.size() < wanted) buffer.resize(wanted);
  buffer_at = offset;
  buffered = 0;
  while (buffered < n) {
    const ssize_t got =
        pread(file, buffer.data() + buffered, wanted - buffered, static_cast<off_t>(offset + buffered));
    if (got < 0 && errno == EINTR) continue;
    if (got == 0) errno = 0;  // the file has become shorter
    if (got <= 0) return nullptr;
    buffered += static_cast<std::size_t>(got);
  }
  return buffer.data();
}

Error LogReader::State::unreadable() {
  const std::string reason = errno == 0 ? "the file has become shorter" : std::strerror(errno);
  const std::uint64_t start = std::exchange(at, size);
  skipped += size - start;
  return {path + ": byte " + std::to_string(start) + ": cannot be read: " + reason};
}

Result<std::uint64_t> LogReader::State::find_sync(std::uint64_t from, std::uint64_t end) {
  while (from + sizeof kSyncBytes <= end) {
    const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(kBufferSize, end - from));
    const std::uint8_t* first = bytes(from, n);
    if (first == nullptr) return unreadable();
    const auto* found = std::search(first, first + n, std::begin(kSyncBytes), std::end(kSyncBytes));
    if (found != first + n) return from + static_cast<std::uint64_t>(found - first);
    from += n - (sizeof kSyncBytes - 1);
  }
  return end;
}

Error LogReader::State::damaged(const std::string& why, std::uint64_t resume_from) {
  const std::uint64_t start = at;
  const auto sync = find_sync(resume_from, size);
  if (!sync) return sync.error();
  at = *sync;
  skipped += at - start;
  return {path + ": byte " + std::to_string(start) + ": " + why + "; " + std::to_string(at - start) +
          (at == size ? " bytes to the end of the file are lost" : " bytes to the next event are skipped")};
}

Result<bool> LogReader::State::plausible_end(std::uint64_t event_size) {
  const std::uint64_t end = at + event_size;
  if (end == size) return true;
  if (end + sizeof kSyncBytes <= size) {
    const std::uint8_t* after = bytes(end, sizeof kSyncBytes);
    if (after == nullptr) return unreadable();
    if (std::equal(std::begin(kSyncBytes), std::end(kSyncBytes), after)) return true;
  }
  // No event follows: either the damage is there, or this event's length is wrong and covers other events. It
  // may overlap at most the first byte of the next one.
  const std::uint64_t search_end = std::min<std::uint64_t>(end + sizeof kSyncBytes - 1, size);
  const auto inner = find_sync(at + sizeof kSyncBytes, search_end);
  if (!inner) return inner.error();
  return *inner == search_end;
}

Result<std::optional<Message>> LogReader::State::next() {
  if (at == size) return std::optional<Message>();
  const std::uint64_t left = size - at;
  if (left < kHeaderSize) return damaged("the file ends within an event's header", size);
  const std::uint8_t* head = bytes(at, kHeaderSize);
  if (head == nullptr) return unreadable();
  const Header header(head);
  if (header.sync != kSyncBits)
    return damaged("no event begins here (sync word 0xEDA1DA01 expected)", at + 1);
  if (!header.sane()) {
    return damaged("an event with channel length " + std::to_string(header.channel_size) +
                       " and data length " + std::to_string(header.data_size) +
                       ", expected 1..63 and 0..268435456",
                   at + sizeof kSyncBytes);
  }
  const std::uint64_t event_size = header.event_size();
  if (event_size > left) {
    return damaged("the file ends within an event of " + std::to_string(event_size) + " bytes",
                   at + sizeof kSyncBytes);
  }
  // Includes the following sync word, so that checking it does not move the buffer.
  const auto ahead =
      static_cast<std::size_t>(std::min(event_size + sizeof kSyncBytes, std::min(left, kPrefetchSize)));
  if (bytes(at, ahead) == nullptr) return unreadable();
  const auto plausible = plausible_end(event_size);
  if (!plausible) return plausible.error();
  if (!*plausible) {
    return damaged("an event of " + std::to_string(event_size) + " bytes that covers the next one",
                   at + sizeof kSyncBytes);
  }
  if (header.utime < 0 || header.utime >= kUtimeOf2200) {
    return damaged("an event stamped " + std::to_string(header.utime) + " us, expected 1970 to 2200",
                   at + event_size);
  }
  const std::uint8_t* event = bytes(at, static_cast<std::size_t>(event_size));
  if (event == nullptr) return unreadable();
  const std::uint8_t* channel = event + kHeaderSize;
  const std::uint8_t* data = channel + header.channel_size;
  at += event_size;
  return std::optional<Message>(Message{
      std::string(channel, data), ArrivalTime::from_utime(header.utime), {data, data + header.data_size}});
}

LogReader::LogReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
LogReader::LogReader(LogReader&&) noexcept = default;
LogReader& LogReader::operator=(LogReader&&) noexcept = default;
LogReader::~LogReader() = default;

Result<LogReader> LogReader::open(const std::string& path) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (state->file < 0) return Error{path + ": cannot be opened: " + std::strerror(errno)};
  struct stat found {};
  if (fstat(state->file, &found) != 0) return Error{path + ": cannot be read: " + std::strerror(errno)};
  if (!S_ISREG(found.st_mode)) return Error{path + ": not a regular file, expected an LCM log"};
  state->size = static_cast<std::uint64_t>(found.st_size);
  posix_fadvise(state->file, 0, 0, POSIX_FADV_SEQUENTIAL);
  return LogReader(std::move(state));
}

Result<std::optional<Message>> LogReader::next() { return state_->next(); }
std::uint64_t LogReader::offset() const { return state_->at; }
std::uint64_t LogReader::size() const { return state_->size; }
std::uint64_t LogReader::skipped_bytes() const { return state_->skipped; }

}  // namespace parhelion

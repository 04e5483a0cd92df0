// Appends whole events with one write(2) each; a partial write is truncated.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "protocols/bus/log_file.hpp"
#include "protocols/bus/log_format.hpp"
#include "protocols/bus/queues.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {

struct LogWriter::State {
  int file = -1;
  std::string path;
  std::uint64_t size = 0;   ///< of the file: whole events only
  std::int64_t number = 0;  ///< of the next event
  bool broken = false;      ///< the end of the file could not be truncated
  bool directory_synced = false;
  bool created = false;  ///< the file did not exist before
  bool begun = false;    ///< something was to be written: what the file had before is gone
  std::vector<std::uint8_t> buffer;

  ~State() {
    if (file < 0) return;
    remove_if_unused();
    close(file);
  }
  Status begin();
  void remove_if_unused() const;
  Status append(std::string_view channel, ArrivalTime stamp, std::span<const std::uint8_t> payload);
  Status flush(std::int64_t events);
  void sync_directory();
};

Status LogWriter::State::append(std::string_view channel, ArrivalTime stamp,
                                std::span<const std::uint8_t> payload) {
  if (Status status = check_message(channel, payload.size()); !status)
    return Error{path + ": " + status.error().message};
  if (payload.size() > std::size_t{kMaxData}) {
    return Error{path + ": channel " + std::string(channel) + ": " + std::to_string(payload.size()) +
                 " bytes, an event has at most 268435456"};
  }
  const std::size_t start = buffer.size();
  buffer.resize(start + kHeaderSize);
  std::uint8_t* at = buffer.data() + start;
  wire::big_endian(kSyncBits, at);
  wire::big_endian(number, at + 4);
  wire::big_endian(stamp.utime(), at + 12);
  wire::big_endian(static_cast<std::int32_t>(channel.size()), at + 20);
  wire::big_endian(static_cast<std::int32_t>(payload.size()), at + 24);
  buffer.insert(buffer.end(), channel.begin(), channel.end());
  buffer.insert(buffer.end(), payload.begin(), payload.end());
  ++number;
  return {};
}

/// A file that is overwritten keeps its events until there are new ones.
Status LogWriter::State::begin() {
  if (begun) return {};
  if (ftruncate(file, 0) != 0) return Error{path + ": cannot be emptied: " + std::strerror(errno)};
  begun = true;
  return {};
}

/// An empty file of ours would be in the way of the next attempt. Another one under its name is left alone.
void LogWriter::State::remove_if_unused() const {
  struct stat ours {
  }, found{};
  if (!created || size > 0 || fstat(file, &ours) != 0 || ::stat(path.c_str(), &found) != 0) return;
  if (ours.st_dev == found.st_dev && ours.st_ino == found.st_ino && ours.st_size == 0) ::unlink(path.c_str());
}

Status LogWriter::State::flush(std::int64_t events) {
  if (Status ready = begin(); !ready) {
    number -= events;
    return ready;
  }
  std::size_t written = 0;
  while (written < buffer.size()) {
    const ssize_t n = ::write(file, buffer.data() + written, buffer.size() - written);
    if (n >= 0) {
      written += static_cast<std::size_t>(n);
    } else if (errno != EINTR) {
      const std::string reason = std::strerror(errno);
      number -= events;
      if (written > 0 && ftruncate(file, static_cast<off_t>(size)) != 0) broken = true;
      return Error{path + ": byte " + std::to_string(size) + ": cannot write " +
                   std::to_string(buffer.size()) + " bytes: " + reason +
                   "; earlier events are kept; free some space"};
    }
  }
  size += written;
  return {};
}

void LogWriter::State::sync_directory() {
  const auto parent = std::filesystem::absolute(path).parent_path();
  const int directory = ::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (directory < 0) return;
  directory_synced = fsync(directory) == 0;
  close(directory);
}

LogWriter::LogWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
LogWriter::LogWriter(LogWriter&&) noexcept = default;
LogWriter& LogWriter::operator=(LogWriter&&) noexcept = default;
LogWriter::~LogWriter() = default;

Result<LogWriter> LogWriter::create(const std::string& path, bool overwrite) {
  auto state = std::make_unique<State>();
  state->path = path;
  constexpr int flags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC;
  state->file = ::open(path.c_str(), flags | O_EXCL, 0644);
  state->created = state->file >= 0;
  if (!state->created && errno == EEXIST) {
    if (!overwrite)
      return Error{path + ": exists and is not overwritten; choose another name or use --force"};
    state->file = ::open(path.c_str(), flags, 0644);
  }
  if (state->file < 0) return Error{path + ": cannot be created: " + std::strerror(errno)};
  struct stat found {};
  if (fstat(state->file, &found) != 0 || !S_ISREG(found.st_mode)) {
    return Error{path + ": not a regular file: an LCM log cannot be written there"};
  }
  if (flock(state->file, LOCK_EX | LOCK_NB) != 0) return Error{path + ": another program is writing it"};
  return LogWriter(std::move(state));
}

Status LogWriter::write(std::string_view channel, ArrivalTime stamp, std::span<const std::uint8_t> payload) {
  if (state_->broken)
    return Error{state_->path +
                 ": ends in an incomplete event that could not be truncated; nothing more is written"};
  state_->buffer.clear();
  if (Status status = state_->append(channel, stamp, payload); !status) return status;
  return state_->flush(1);
}

Status LogWriter::write(std::span<const Message> messages) {
  if (state_->broken)
    return Error{state_->path +
                 ": ends in an incomplete event that could not be truncated; nothing more is written"};
  state_->buffer.clear();
  const std::int64_t first = state_->number;
  for (const Message& message : messages) {
    Status status = state_->append(message.channel, message.arrival, message.payload);
    if (status) continue;
    state_->number = first;
    return status;
  }
  return state_->flush(static_cast<std::int64_t>(messages.size()));
}

Status LogWriter::sync() {
  if (!state_->directory_synced) state_->sync_directory();
  if (fdatasync(state_->file) == 0) return {};
  return Error{state_->path + ": cannot be synced to disk: " + std::strerror(errno)};
}

}  // namespace parhelion

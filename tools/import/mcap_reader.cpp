#include "tools/import/mcap_reader.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tools/import/bag_chunk.hpp"
#include "tools/import/ros2_names.hpp"
#include "tools/import/zstd_data.hpp"
#include "tools/mcap_records.hpp"

namespace parhelion::tools {
namespace {

using mcap::Opcode;
using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kRecordHead = 9;  ///< opcode and length
constexpr std::uint64_t kLargestChunk = std::uint64_t{1} << 31U;

/// Consumes fields from the front; after the first that is missing all are zero or empty.
class Fields {
 public:
  explicit Fields(Bytes bytes) : bytes_(bytes) {}

  template <class Unsigned>
  Unsigned number() {
    const Bytes field = take(sizeof(Unsigned));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < field.size(); ++i) value |= std::uint64_t{field[i]} << (8 * i);
    return static_cast<Unsigned>(value);
  }
  std::string text() {
    const Bytes field = take(number<std::uint32_t>());
    return {field.begin(), field.end()};
  }
  Bytes take(std::uint64_t count) {
    ok_ = ok_ && count <= bytes_.size() - at_;
    if (!ok_) return {};
    at_ += static_cast<std::size_t>(count);
    return bytes_.subspan(at_ - static_cast<std::size_t>(count), static_cast<std::size_t>(count));
  }
  Bytes rest() { return take(bytes_.size() - at_); }
  bool ok() const { return ok_; }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

struct Channel {
  std::string topic, type;
  ros::Encoding encoding = ros::Encoding::cdr;
};

struct Record {
  Opcode opcode;
  Bytes content;
};

}  // namespace

struct McapReader::State {
  std::string path;
  std::ifstream file;
  std::uint64_t size = 0, position = 0;  ///< of the next record
  std::map<std::uint16_t, std::string> schemas;
  std::map<std::uint16_t, Channel> channels;
  std::vector<std::uint8_t> content;  ///< of the last record of the file
  std::vector<std::uint8_t> chunk;
  std::vector<std::uint8_t> inflated;  ///< the last message, if it was compressed by itself
  std::size_t at = 0;                  ///< in chunk
  std::uint64_t chunk_position = 0;    ///< in the file
  std::optional<Error> pending;        ///< reported after what was read before the damage
  std::uint64_t messages = 0;
  bool ended = false;

  Error damage(std::uint64_t where, const std::string& what) const {
    return Error{path + ": byte " + std::to_string(where) + ": " + what};
  }
  std::optional<Record> record_of_file();
  std::optional<Record> record_of_chunk();
  void open_chunk(Bytes record, std::uint64_t where);
  bool take(const Record& record, std::uint64_t where, BagMessage& message);
};

std::optional<Record> McapReader::State::record_of_file() {
  std::uint8_t head[kRecordHead];
  if (!file.read(reinterpret_cast<char*>(head), sizeof head)) return std::nullopt;
  Fields fields(Bytes(head).subspan(1));
  const auto length = fields.number<std::uint64_t>();
  if (length > size - position - kRecordHead) return std::nullopt;
  content.resize(static_cast<std::size_t>(length));
  if (!file.read(reinterpret_cast<char*>(content.data()), static_cast<std::streamsize>(length)))
    return std::nullopt;
  position += kRecordHead + length;
  return Record{Opcode{head[0]}, content};
}

std::optional<Record> McapReader::State::record_of_chunk() {
  Fields fields(Bytes(chunk).subspan(at));
  const Opcode opcode{fields.number<std::uint8_t>()};
  const Bytes found = fields.take(fields.number<std::uint64_t>());
  if (!fields.ok()) return std::nullopt;
  at += kRecordHead + found.size();
  return Record{opcode, found};
}

/// Its records, as far as they can be inflated.
void McapReader::State::open_chunk(Bytes record, std::uint64_t where) {
  Fields fields(record);
  fields.take(2 * sizeof(std::uint64_t));  // of the times of its messages
  const auto inflated = fields.number<std::uint64_t>();
  fields.take(sizeof(std::uint32_t));  // the checksum: a damaged record is said by its message
  const std::string compression = fields.text();
  const Bytes records = fields.take(fields.number<std::uint64_t>());
  chunk.clear();
  at = 0;
  chunk_position = where;
  if (!fields.ok() || inflated > kLargestChunk) {
    pending = damage(where, "a chunk cannot be read; it is skipped");
    return;
  }
  const auto count = static_cast<std::uint32_t>(inflated);
  Status done = compression == "zstd"
                    ? inflate_zstd(records, count, chunk)
                    : inflate_chunk(compression.empty() ? "none" : compression, records, count, chunk);
  if (done && chunk.size() != count) done = Error{"it holds other than the announced number of bytes"};
  if (!done) pending = damage(where, "a chunk cannot be read whole: " + done.error().message);
}

/// True: it is a message.
bool McapReader::State::take(const Record& record, std::uint64_t where, BagMessage& message) {
  Fields fields(record.content);
  switch (record.opcode) {
    case Opcode::schema: {
      const auto id = fields.number<std::uint16_t>();
      schemas[id] = fields.text();
      return false;
    }
    case Opcode::channel: {
      const auto id = fields.number<std::uint16_t>(), schema = fields.number<std::uint16_t>();
      const std::string topic = fields.text(), encoding = fields.text();
      const bool ros1 = encoding == "ros1";
      channels[id] = {topic, ros2_type(schemas[schema], ros1 ? "cdr" : encoding),
                      ros1 ? ros::Encoding::ros1 : ros::Encoding::cdr};
      return false;
    }
    case Opcode::chunk:
      open_chunk(record.content, where);
      return false;
    case Opcode::message:
      break;
    default:
      return false;
  }
  const auto channel = channels.find(fields.number<std::uint16_t>());
  fields.take(sizeof(std::uint32_t));  // number in its channel
  const auto received = fields.number<std::uint64_t>();
  fields.take(sizeof(std::uint64_t));  // time of publication
  if (!fields.ok() || channel == channels.end()) {
    if (!pending)
      pending = damage(where, "a message that is too short, or of a channel that is not described");
    return false;
  }
  Bytes bytes = fields.rest();
  if (is_zstd(bytes)) {
    if (const Status done = inflate_message(bytes, inflated); !done) {
      if (!pending) pending = damage(where, "a message: " + done.error().message);
      return false;
    }
    bytes = inflated;
  }
  message.topic = channel->second.topic;
  message.type = channel->second.type;
  constexpr std::uint64_t last = std::numeric_limits<std::int64_t>::max();
  message.received = {static_cast<std::int64_t>(std::min(received, last))};
  message.number = ++messages;
  message.bytes = {bytes, channel->second.encoding};
  return true;
}

McapReader::McapReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
McapReader::~McapReader() = default;

Result<std::unique_ptr<BagSource>> McapReader::open(const std::filesystem::path& path) {
  auto state = std::make_unique<State>();
  state->path = path.string();
  state->file.open(path, std::ios::binary);
  if (!state->file) return Error{state->path + ": cannot be opened: " + std::strerror(errno)};
  std::error_code ignored;
  state->size = std::filesystem::file_size(path, ignored);
  std::string head(mcap::kMagic.size(), '\0');
  if (!state->file.read(head.data(), static_cast<std::streamsize>(head.size())) || head != mcap::kMagic)
    return Error{state->path + ": byte 0: an MCAP file is expected"};
  state->position = head.size();
  return std::unique_ptr<BagSource>(new McapReader(std::move(state)));
}

Result<bool> McapReader::next(BagMessage& message) {
  State& s = *state_;
  for (;;) {
    if (s.at < s.chunk.size()) {
      const std::size_t where = s.at;
      const auto record = s.record_of_chunk();
      // A chunk within a chunk would replace the bytes that it is read from.
      const bool valid = record && record->opcode != Opcode::chunk;
      if (valid && s.take(*record, s.chunk_position, message)) return true;
      if (!valid) {
        s.at = s.chunk.size();
        if (!s.pending)
          s.pending =
              s.damage(s.chunk_position,
                       "a record at byte " + std::to_string(where) +
                           " of the chunk that starts here cannot be read; the rest of it is skipped");
      }
      if (s.at < s.chunk.size()) continue;
    }
    if (s.pending) {
      Error damage = std::move(*s.pending);
      s.pending.reset();
      return damage;
    }
    if (s.ended || s.position >= s.size) return false;
    const std::uint64_t where = s.position;
    const auto record = s.record_of_file();
    if (!record) {
      s.ended = true;
      return s.damage(where, "a record cannot be read: the recording is cut off or damaged here");
    }
    if (record->opcode == Opcode::data_end || record->opcode == Opcode::footer) {
      s.ended = true;  // a summary of what came before follows
      return false;
    }
    if (s.take(*record, where, message)) return true;
  }
}

std::uint64_t McapReader::messages() const { return state_->messages; }
double McapReader::done() const { return static_cast<double>(state_->position); }
double McapReader::total() const { return static_cast<double>(state_->size); }

}  // namespace parhelion::tools

#include "tools/import/mcap_reader.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tools/export/mcap_records.hpp"
#include "tools/import/bag_chunk.hpp"
#include "tools/import/ros2_names.hpp"
#include "tools/import/zstd_data.hpp"

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

class McapReader final : public BagSource {
 public:
  explicit McapReader(std::string name) : path_(std::move(name)) {}

  Status open();
  Result<bool> next(BagMessage& message) override;
  std::uint64_t messages() const override { return count_; }
  double done() const override { return static_cast<double>(position_); }
  double total() const override { return static_cast<double>(size_); }

 private:
  Error damage(std::uint64_t where, const std::string& what) const {
    return Error{path_ + ": byte " + std::to_string(where) + ": " + what};
  }
  std::optional<Record> record_of_file();
  std::optional<Record> record_of_chunk();
  void open_chunk(Bytes record, std::uint64_t where);
  bool take_of_chunk(BagMessage& message);
  bool take(const Record& record, std::uint64_t where, BagMessage& message);

  const std::string path_;
  std::ifstream file_;
  std::uint64_t size_ = 0, position_ = 0;  ///< of the next record
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::vector<std::uint8_t> content_;  ///< of the last record of the file
  std::vector<std::uint8_t> chunk_;
  std::vector<std::uint8_t> inflated_;  ///< the last message, if it was compressed by itself
  std::size_t at_ = 0;                  ///< in chunk
  std::uint64_t chunk_position_ = 0;    ///< in the file
  std::optional<Error> pending_;        ///< reported after what was read before the damage
  std::uint64_t count_ = 0;             ///< messages read so far
  bool ended_ = false;
};

std::optional<Record> McapReader::record_of_file() {
  std::uint8_t head[kRecordHead];
  if (!file_.read(reinterpret_cast<char*>(head), sizeof head)) return std::nullopt;
  Fields fields(Bytes(head).subspan(1));
  const auto length = fields.number<std::uint64_t>();
  if (length > size_ - position_ - kRecordHead) return std::nullopt;
  content_.resize(static_cast<std::size_t>(length));
  if (!file_.read(reinterpret_cast<char*>(content_.data()), static_cast<std::streamsize>(length)))
    return std::nullopt;
  position_ += kRecordHead + length;
  return Record{Opcode{head[0]}, content_};
}

std::optional<Record> McapReader::record_of_chunk() {
  Fields fields(Bytes(chunk_).subspan(at_));
  const Opcode opcode{fields.number<std::uint8_t>()};
  const Bytes found = fields.take(fields.number<std::uint64_t>());
  if (!fields.ok()) return std::nullopt;
  at_ += kRecordHead + found.size();
  return Record{opcode, found};
}

/// Its records, as far as they can be inflated.
void McapReader::open_chunk(Bytes record, std::uint64_t where) {
  Fields fields(record);
  fields.take(2 * sizeof(std::uint64_t));  // of the times of its messages
  const auto announced = fields.number<std::uint64_t>();
  fields.take(sizeof(std::uint32_t));  // the checksum: a damaged record is said by its message
  const std::string compression = fields.text();
  const Bytes records = fields.take(fields.number<std::uint64_t>());
  chunk_.clear();
  at_ = 0;
  chunk_position_ = where;
  if (!fields.ok() || announced > kLargestChunk) {
    pending_ = damage(where, "a chunk cannot be read; it is skipped");
    return;
  }
  const auto bytes = static_cast<std::uint32_t>(announced);
  Status done = compression == "zstd"
                    ? inflate_zstd(records, bytes, chunk_)
                    : inflate_chunk(compression.empty() ? "none" : compression, records, bytes, chunk_);
  if (done && chunk_.size() != bytes) done = Error{"it does not have the announced number of bytes"};
  if (!done) pending_ = damage(where, "a chunk cannot be read whole: " + done.error().message);
}

/// True: it is a message.
bool McapReader::take(const Record& record, std::uint64_t where, BagMessage& message) {
  Fields fields(record.content);
  switch (record.opcode) {
    case Opcode::schema: {
      const auto id = fields.number<std::uint16_t>();
      schemas_[id] = fields.text();
      return false;
    }
    case Opcode::channel: {
      const auto id = fields.number<std::uint16_t>(), schema = fields.number<std::uint16_t>();
      const std::string topic = fields.text(), encoding = fields.text();
      const bool ros1 = encoding == "ros1";
      channels_[id] = {topic, ros2_type(schemas_[schema], ros1 ? "cdr" : encoding),
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
  const auto channel = channels_.find(fields.number<std::uint16_t>());
  fields.take(sizeof(std::uint32_t));  // number in its channel
  const auto received = fields.number<std::uint64_t>();
  fields.take(sizeof(std::uint64_t));  // time of publication
  if (!fields.ok() || channel == channels_.end()) {
    if (!pending_)
      pending_ = damage(where, "a message that is too short, or of a channel that is not described");
    return false;
  }
  Bytes bytes = fields.rest();
  if (is_zstd(bytes)) {
    if (const Status done = inflate_message(bytes, inflated_); !done) {
      if (!pending_) pending_ = damage(where, "a message: " + done.error().message);
      return false;
    }
    bytes = inflated_;
  }
  message.topic = channel->second.topic;
  message.type = channel->second.type;
  constexpr std::uint64_t last = std::numeric_limits<std::int64_t>::max();
  message.received = {static_cast<std::int64_t>(std::min(received, last))};
  message.number = ++count_;
  message.bytes = {bytes, channel->second.encoding};
  return true;
}

Status McapReader::open() {
  file_.open(path_, std::ios::binary);
  if (!file_) return Error{path_ + ": cannot be opened: " + std::strerror(errno)};
  std::error_code ignored;
  size_ = std::filesystem::file_size(path_, ignored);
  std::string head(mcap::kMagic.size(), '\0');
  if (!file_.read(head.data(), static_cast<std::streamsize>(head.size())) || head != mcap::kMagic)
    return Error{path_ + ": byte 0: an MCAP file is expected"};
  position_ = head.size();
  return {};
}

/// True: the next record of the chunk is a message.
bool McapReader::take_of_chunk(BagMessage& message) {
  const std::size_t where = at_;
  const auto record = record_of_chunk();
  // A chunk within a chunk would replace the bytes that it is read from.
  if (record && record->opcode != Opcode::chunk) return take(*record, chunk_position_, message);
  at_ = chunk_.size();
  if (!pending_)
    pending_ = damage(chunk_position_,
                      "a record at byte " + std::to_string(where) +
                          " of the chunk that starts here cannot be read; the rest of it is skipped");
  return false;
}

Result<bool> McapReader::next(BagMessage& message) {
  for (;;) {
    while (at_ < chunk_.size())
      if (take_of_chunk(message)) return true;
    if (pending_) {
      Error fault = std::move(*pending_);
      pending_.reset();
      return fault;
    }
    if (ended_ || position_ >= size_) return false;
    const std::uint64_t where = position_;
    const auto record = record_of_file();
    if (!record) {
      ended_ = true;
      return damage(where, "a record cannot be read: the recording is cut off or damaged here");
    }
    if (record->opcode == Opcode::data_end || record->opcode == Opcode::footer) {
      ended_ = true;  // a summary of what came before follows
      return false;
    }
    if (take(*record, where, message)) return true;
  }
}

}  // namespace

Result<std::unique_ptr<BagSource>> open_mcap(const std::filesystem::path& path) {
  auto bag = std::make_unique<McapReader>(path.string());
  if (const Status opened = bag->open(); !opened) return opened.error();
  return std::unique_ptr<BagSource>(std::move(bag));
}

}  // namespace parhelion::tools

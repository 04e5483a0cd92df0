#include "tools/import/rosbag_reader.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "tools/import/bag_chunk.hpp"

namespace parhelion::tools {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint32_t kLargestHeader = 1U << 20;

enum class Op : std::uint8_t {
  message = 2,
  file_header = 3,
  index = 4,
  chunk = 5,
  chunk_info = 6,
  connection = 7
};

struct Connection {
  std::string topic, type;
};

/// A record: header fields and data, as views of a buffer.
struct Record {
  std::optional<Op> op;
  BagFields fields;
  std::span<const std::uint8_t> data;
};

std::uint32_t little_endian(const std::uint8_t* p) {
  return p[0] | (std::uint32_t{p[1]} << 8) | (std::uint32_t{p[2]} << 16) | (std::uint32_t{p[3]} << 24);
}

std::optional<Op> op_of(const BagFields& fields) {
  const auto op = bag_number<std::uint8_t>(fields, "op");
  if (!op || *op < 2 || *op > 7) return std::nullopt;
  return static_cast<Op>(*op);
}

/// Parses a record of `bytes` at `at` and advances `at` behind it; nullopt: not a record.
std::optional<Record> take_record(std::span<const std::uint8_t> bytes, std::size_t& at) {
  const auto block = [&](std::size_t start) -> std::optional<std::span<const std::uint8_t>> {
    if (bytes.size() - start < 4) return std::nullopt;
    const std::size_t length = little_endian(bytes.data() + start);
    if (length > bytes.size() - start - 4) return std::nullopt;
    return bytes.subspan(start + 4, length);
  };
  const auto header = block(at);
  if (!header) return std::nullopt;
  const std::size_t data_at = at + 4 + header->size();
  const auto data = block(data_at);
  auto fields = parse_bag_fields(*header);
  if (!data || !fields) return std::nullopt;
  Record record{op_of(*fields), std::move(*fields), *data};
  if (!record.op) return std::nullopt;
  at = data_at + 4 + data->size();
  return record;
}

}  // namespace

struct BagReader::State {
  std::string path;
  std::FILE* file = nullptr;
  std::uint64_t size = 0;
  std::uint64_t position = 0;  ///< of the next record in the file
  std::map<std::uint32_t, Connection> connections;
  std::vector<std::uint8_t> header, data;  ///< of the last record read from the file
  std::vector<std::uint8_t> chunk;
  std::uint64_t chunk_position = 0;
  std::size_t at = 0;  ///< in chunk
  std::uint64_t messages = 0;
  std::optional<Error> pending;  ///< reported after the data before the damage

  ~State() {
    if (file != nullptr) std::fclose(file);
  }

  Error damage(std::uint64_t where, const std::string& what) const {
    return Error{path + ": byte " + std::to_string(where) + ": " + what};
  }

  bool read_block(std::vector<std::uint8_t>& block, std::uint64_t max_size) {
    std::uint8_t length[4];
    if (std::fread(length, 1, 4, file) != 4) return false;
    const std::uint32_t n = little_endian(length);
    const auto here = static_cast<std::uint64_t>(std::ftell(file));
    if (n > max_size || n > size - std::min(size, here)) return false;
    block.resize(n);
    return std::fread(block.data(), 1, n, file) == n;
  }

  std::optional<Record> read_record() {
    std::fseek(file, static_cast<long>(position), SEEK_SET);
    if (!read_block(header, kLargestHeader) || !read_block(data, size)) return std::nullopt;
    auto fields = parse_bag_fields(header);
    if (!fields) return std::nullopt;
    Record record{op_of(*fields), std::move(*fields), data};
    if (!record.op) return std::nullopt;
    position = static_cast<std::uint64_t>(std::ftell(file));
    return record;
  }

  /// Seeks from a damaged record to the next chunk by its "op" field.
  bool resynchronize();
  Status open_chunk(const Record& record, std::uint64_t where);
  void add_connection(const Record& record);
  Result<bool> give(const Record& record, BagMessage& message, std::uint64_t where);
};

bool BagReader::State::resynchronize() {
  constexpr std::string_view mark{"\x04\0\0\0op=\x05", 8};
  constexpr std::size_t farthest = 64;  // from the start of a chunk's record to its "op"
  std::vector<char> window(1U << 16);
  std::uint64_t from = position + 1;
  while (from < size) {
    std::fseek(file, static_cast<long>(from), SEEK_SET);
    const std::size_t got = std::fread(window.data(), 1, window.size(), file);
    const std::string_view view(window.data(), got);
    for (std::size_t found = view.find(mark); found != std::string_view::npos;
         found = view.find(mark, found + 1)) {
      const std::uint64_t op_at = from + found;
      for (std::uint64_t back = 4; back <= farthest && back <= op_at; ++back) {
        const std::uint64_t candidate = op_at - back;
        if (candidate <= position) break;
        const std::uint64_t damaged_at = std::exchange(position, candidate);
        if (read_record()) return position = candidate, true;
        position = damaged_at;
      }
    }
    if (got < window.size()) break;
    from += got - mark.size();
  }
  position = size;
  return false;
}

Status BagReader::State::open_chunk(const Record& record, std::uint64_t where) {
  const auto inflated = bag_number<std::uint32_t>(record.fields, "size");
  if (!inflated) return damage(where, "a chunk without its size; skipped");
  const Status done = inflate_chunk(bag_text(record.fields, "compression"), record.data, *inflated, chunk);
  chunk_position = where;
  at = 0;
  return done.ok() ? Status() : damage(where, "a chunk cannot be read whole: " + done.error().message);
}

void BagReader::State::add_connection(const Record& record) {
  const auto id = bag_number<std::uint32_t>(record.fields, "conn");
  const auto header_fields = parse_bag_fields(record.data);
  if (!id || !header_fields) return;
  connections[*id] = {bag_text(record.fields, "topic"), bag_text(*header_fields, "type")};
}

Result<bool> BagReader::State::give(const Record& record, BagMessage& message, std::uint64_t where) {
  const auto id = bag_number<std::uint32_t>(record.fields, "conn");
  const auto time = bag_number<std::uint64_t>(record.fields, "time");
  const auto connection = id ? connections.find(*id) : connections.end();
  if (connection == connections.end() || !time) {
    return damage(where, "a message without time, or of a connection that was not announced; skipped");
  }
  message.topic = connection->second.topic;
  message.type = connection->second.type;
  const auto seconds_part = static_cast<std::int64_t>(*time & 0xFFFFFFFF),
             ns = static_cast<std::int64_t>(*time >> 32);
  message.received = {seconds_part * 1'000'000'000 + ns};
  message.number = ++messages;
  message.bytes = {record.data, ros::Encoding::ros1};
  return true;
}

BagReader::BagReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
BagReader::BagReader(BagReader&&) noexcept = default;
BagReader& BagReader::operator=(BagReader&&) noexcept = default;
BagReader::~BagReader() = default;

Result<BagReader> BagReader::open(const std::filesystem::path& path) {
  auto state = std::make_unique<State>();
  state->path = path.string();
  state->file = std::fopen(state->path.c_str(), "rb");
  if (state->file == nullptr) return Error{state->path + ": cannot be opened: " + std::strerror(errno)};
  std::error_code ignored;
  state->size = std::filesystem::file_size(path, ignored);
  std::string head(kMagic.size(), '\0');
  if (std::fread(head.data(), 1, head.size(), state->file) != head.size() || head != kMagic) {
    return Error{state->path + ": byte 0: '#ROSBAG V2.0' is expected"};
  }
  state->position = kMagic.size();
  return BagReader(std::move(state));
}

Result<bool> BagReader::next(BagMessage& message) {
  State& s = *state_;
  for (;;) {
    if (s.at < s.chunk.size()) {
      const std::size_t where = s.at;
      const auto record = take_record(s.chunk, s.at);
      if (!record) {
        s.at = s.chunk.size();
        if (s.pending) continue;
        return s.damage(
            s.chunk_position,
            "a record at byte " + std::to_string(where) +
                " of the chunk that starts here cannot be read; the rest of the chunk is skipped");
      }
      if (record->op == Op::connection) s.add_connection(*record);
      if (record->op == Op::message) return s.give(*record, message, s.chunk_position);
      continue;
    }
    if (s.pending) {
      const Error pending_error = std::move(*std::exchange(s.pending, std::nullopt));
      return pending_error;
    }
    if (s.position >= s.size) return false;
    const std::uint64_t where = s.position;
    const auto record = s.read_record();
    if (!record) {
      const bool more = s.resynchronize();
      return s.damage(where,
                      more ? "a record cannot be read; resuming at byte " + std::to_string(s.position)
                           : "a record cannot be read and none follows: the bag is cut off or damaged here");
    }
    if (record->op == Op::connection) s.add_connection(*record);
    if (record->op == Op::message) return s.give(*record, message, where);
    if (record->op == Op::chunk) {
      if (const Status opened = s.open_chunk(*record, where); !opened) s.pending = opened.error();
    }
  }
}

std::uint64_t BagReader::messages() const { return state_->messages; }
double BagReader::done() const { return static_cast<double>(state_->position); }
double BagReader::total() const { return static_cast<double>(state_->size); }

}  // namespace parhelion::tools

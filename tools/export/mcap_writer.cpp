#include "tools/export/mcap_writer.hpp"

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "tools/export/mcap_records.hpp"

namespace parhelion::tools {
namespace {

using mcap::Opcode;
using mcap::put;
using mcap::put_record;
using mcap::put_text;
using mcap::put_texts;

std::uint32_t crc_of(std::uint32_t before, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

const char* name_of(McapCompression compression) {
  return compression == McapCompression::zstd ? "zstd" : compression == McapCompression::lz4 ? "lz4" : "";
}

/// Compresses into `out`; false if the library fails.
bool compress(McapCompression compression, const std::string& records, std::string& out) {
  if (compression == McapCompression::zstd) {
    constexpr int fast = 1;
    out.resize(ZSTD_compressBound(records.size()));
    const std::size_t size = ZSTD_compress(out.data(), out.size(), records.data(), records.size(), fast);
    if (ZSTD_isError(size) != 0) return false;
    out.resize(size);
  } else if (compression == McapCompression::lz4) {
    out.resize(LZ4F_compressFrameBound(records.size(), nullptr));
    const std::size_t size =
        LZ4F_compressFrame(out.data(), out.size(), records.data(), records.size(), nullptr);
    if (LZ4F_isError(size) != 0) return false;
    out.resize(size);
  } else {
    out = records;
  }
  return true;
}

struct Span {
  std::uint64_t first = std::numeric_limits<std::uint64_t>::max(), last = 0;
  void add(std::uint64_t t) {
    first = std::min(first, t);
    last = std::max(last, t);
  }
  std::uint64_t begin() const { return last == 0 && first > 0 ? 0 : first; }  ///< 0: nothing was added
};

using ChunkMessages = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;

}  // namespace

struct McapWriter::State {
  std::string path;
  McapOptions options;
  std::FILE* file = nullptr;
  std::uint64_t at = 0;   ///< bytes written
  std::uint32_t crc = 0;  ///< of them
  std::string records;    ///< of the current chunk
  Span chunk_time, time;
  ChunkMessages chunk_messages;  ///< log time and offset in `records`, by channel
  std::string compressed, content;
  std::string schemas, channels, chunk_indexes, metadata_indexes;  ///< records for the summary
  std::uint16_t schema_count = 0, channel_count = 0;
  std::uint32_t chunk_count = 0, metadata_count = 0;
  std::map<std::uint16_t, std::uint64_t> message_counts;

  ~State() {
    if (file != nullptr) std::fclose(file);
  }

  Error fault() const { return {path + ": cannot be written: " + std::strerror(errno)}; }
  Status append(std::string_view bytes);
  Status append_record(Opcode opcode, std::string_view record) {
    std::string whole;
    put_record(whole, opcode, record);
    return append(whole);
  }
  Status flush_chunk();
  std::string statistics() const;
  Status write_summary();
};

Status McapWriter::State::append(std::string_view bytes) {
  errno = 0;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size()) return fault();
  at += bytes.size();
  crc = crc_of(crc, bytes);
  return {};
}

Status McapWriter::State::flush_chunk() {
  if (records.empty()) return {};
  if (!compress(options.compression, records, compressed))
    return Error{path + ": a chunk of " + std::to_string(records.size()) + " bytes cannot be compressed"};
  const std::uint64_t chunk_start = at;
  content.clear();
  put(content, chunk_time.begin());
  put(content, chunk_time.last);
  put(content, static_cast<std::uint64_t>(records.size()));
  put(content, crc_of(0, records));
  put_text(content, name_of(options.compression));
  put(content, static_cast<std::uint64_t>(compressed.size()));
  content += compressed;
  if (const Status written = append_record(Opcode::chunk, content); !written) return written;
  const std::uint64_t chunk_length = at - chunk_start, indexes_start = at;
  std::string offsets;
  for (auto& [channel, messages] : chunk_messages) {
    std::stable_sort(messages.begin(), messages.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    put(offsets, channel);
    put(offsets, at);
    content.clear();
    put(content, channel);
    put(content, static_cast<std::uint32_t>(messages.size() * 16));
    for (const auto& [log_time, offset] : messages) {
      put(content, log_time);
      put(content, offset);
    }
    if (const Status written = append_record(Opcode::message_index, content); !written) return written;
  }
  content.clear();
  put(content, chunk_time.begin());
  put(content, chunk_time.last);
  put(content, chunk_start);
  put(content, chunk_length);
  put_text(content, offsets);
  put(content, at - indexes_start);
  put_text(content, name_of(options.compression));
  put(content, static_cast<std::uint64_t>(compressed.size()));
  put(content, static_cast<std::uint64_t>(records.size()));
  put_record(chunk_indexes, Opcode::chunk_index, content);
  ++chunk_count;
  records.clear();
  chunk_messages.clear();
  chunk_time = {};
  return {};
}

std::string McapWriter::State::statistics() const {
  std::uint64_t messages = 0;
  std::string counts, record;
  for (const auto& [channel, count] : message_counts) {
    messages += count;
    put(counts, channel);
    put(counts, count);
  }
  put(record, messages);
  put(record, schema_count);
  put(record, static_cast<std::uint32_t>(channel_count));
  put(record, std::uint32_t{0});  // attachments
  put(record, metadata_count);
  put(record, chunk_count);
  put(record, time.begin());
  put(record, time.last);
  put_text(record, counts);
  std::string whole;
  put_record(whole, Opcode::statistics, record);
  return whole;
}

/// Writes groups of records, their offsets, and the footer, whose CRC covers everything except itself.
Status McapWriter::State::write_summary() {
  const std::uint64_t start = at;
  std::string summary, offsets;
  const std::pair<Opcode, std::string> groups[] = {{Opcode::schema, schemas},
                                                   {Opcode::channel, channels},
                                                   {Opcode::statistics, statistics()},
                                                   {Opcode::chunk_index, chunk_indexes},
                                                   {Opcode::metadata_index, metadata_indexes}};
  for (const auto& [opcode, group] : groups) {
    if (group.empty()) continue;
    std::string record;
    put(record, static_cast<std::uint8_t>(opcode));
    put(record, start + summary.size());
    put(record, static_cast<std::uint64_t>(group.size()));
    put_record(offsets, Opcode::summary_offset, record);
    summary += group;
  }
  constexpr std::uint64_t footer_length = 20;
  const std::uint64_t offsets_start = start + summary.size();
  summary += offsets;
  put(summary, static_cast<std::uint8_t>(Opcode::footer));
  put(summary, footer_length);
  put(summary, start);
  put(summary, offsets_start);
  put(summary, crc_of(0, summary));
  summary += mcap::kMagic;
  return append(summary);
}

McapWriter::McapWriter(std::unique_ptr<State> state) : state_(std::move(state)) {}
McapWriter::McapWriter(McapWriter&&) noexcept = default;
McapWriter& McapWriter::operator=(McapWriter&&) noexcept = default;
McapWriter::~McapWriter() = default;

Result<McapWriter> McapWriter::create(const std::string& path, const McapOptions& options) {
  auto state = std::make_unique<State>();
  state->path = path;
  state->options = options;
  state->file = std::fopen(path.c_str(), "wbe");
  if (state->file == nullptr) return state->fault();
  std::string header;
  put_text(header, "");  // profile: none
  put_text(header, options.library);
  if (const Status written = state->append(mcap::kMagic); !written) return written.error();
  if (const Status written = state->append_record(Opcode::header, header); !written) return written.error();
  return McapWriter(std::move(state));
}

std::uint16_t McapWriter::add_schema(const std::string& name, const std::string& encoding,
                                     const std::string& text) {
  const std::uint16_t id = ++state_->schema_count;
  std::string record;
  put(record, id);
  put_text(record, name);
  put_text(record, encoding);
  put_text(record, text);
  put_record(state_->records, Opcode::schema, record);
  put_record(state_->schemas, Opcode::schema, record);
  return id;
}

std::uint16_t McapWriter::add_channel(const std::string& topic, std::uint16_t schema,
                                      const std::string& encoding, const Texts& metadata) {
  const std::uint16_t id = ++state_->channel_count;
  std::string record;
  put(record, id);
  put(record, schema);
  put_text(record, topic);
  put_text(record, encoding);
  put_texts(record, metadata);
  put_record(state_->records, Opcode::channel, record);
  put_record(state_->channels, Opcode::channel, record);
  return id;
}

Status McapWriter::write(const McapMessage& message) {
  State& state = *state_;
  state.chunk_messages[message.channel].emplace_back(message.log_time, state.records.size());
  state.chunk_time.add(message.log_time);
  state.time.add(message.log_time);
  ++state.message_counts[message.channel];
  put(state.records, static_cast<std::uint8_t>(Opcode::message));
  put(state.records, std::uint64_t{22} + message.data.size());
  put(state.records, message.channel);
  put(state.records, message.sequence);
  put(state.records, message.log_time);
  put(state.records, message.publish_time);
  state.records += message.data;
  return state.records.size() < state.options.chunk_bytes ? Status{} : state.flush_chunk();
}

Status McapWriter::write_metadata(const std::string& name, const Texts& texts) {
  State& state = *state_;
  if (const Status flushed = state.flush_chunk(); !flushed) return flushed;
  const std::uint64_t start = state.at;
  std::string record;
  put_text(record, name);
  put_texts(record, texts);
  if (const Status written = state.append_record(Opcode::metadata, record); !written) return written;
  std::string index;
  put(index, start);
  put(index, state.at - start);
  put_text(index, name);
  put_record(state.metadata_indexes, Opcode::metadata_index, index);
  ++state.metadata_count;
  return {};
}

Status McapWriter::finish() {
  State& state = *state_;
  if (const Status flushed = state.flush_chunk(); !flushed) return flushed;
  std::string data_end;
  put(data_end, state.crc);
  if (const Status written = state.append_record(Opcode::data_end, data_end); !written) return written;
  if (const Status written = state.write_summary(); !written) return written;
  if (std::fflush(state.file) != 0) return state.fault();
  return {};
}

std::uint64_t McapWriter::bytes() const { return state_->at; }

}  // namespace parhelion::tools

// Writes MCAP files (https://mcap.dev/spec, version 0): indexed chunks, a summary, and CRCs of everything.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "protocols/status.hpp"

namespace parhelion::tools {

enum class McapCompression : std::uint8_t { none, lz4, zstd };

struct McapOptions {
  McapCompression compression = McapCompression::zstd;
  std::uint64_t chunk_bytes = std::uint64_t{4} << 20;  ///< of records, before compression
  std::string library;                                 ///< name of the writing program
};

struct McapMessage {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;      ///< the sender's counter; 0: none
  std::uint64_t log_time = 0;      ///< ns since the epoch, the index key
  std::uint64_t publish_time = 0;  ///< ns since the epoch, set by the sender
  std::string_view data;
};

/// For one thread. A file is complete only after finish(); before that it has no index.
class McapWriter {
 public:
  using Texts = std::map<std::string, std::string>;

  /// Truncates an existing file. Errors contain the file name and the system's message.
  static Result<McapWriter> create(const std::string& path, const McapOptions& options);
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) noexcept;
  ~McapWriter();

  /// Returns the id of a new schema, from 1; `encoding`: "jsonschema".
  std::uint16_t add_schema(const std::string& name, const std::string& encoding, const std::string& text);
  /// Returns the id of a new channel; `schema` 0: none; `encoding` of its messages: "json".
  std::uint16_t add_channel(const std::string& topic, std::uint16_t schema, const std::string& encoding,
                            const Texts& metadata);
  /// The channel must come from add_channel().
  Status write(const McapMessage& message);
  Status write_metadata(const std::string& name, const Texts& texts);
  Status finish();
  std::uint64_t bytes() const;  ///< written so far

 private:
  struct State;
  explicit McapWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools

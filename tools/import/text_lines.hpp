// Lines of a text file that may be compressed (gzip, bzip2), detected by content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "protocols/status.hpp"

namespace parhelion::tools {

class TextLines {
 public:
  static Result<TextLines> open(const std::filesystem::path& path);
  TextLines(TextLines&&) noexcept;
  TextLines& operator=(TextLines&&) noexcept;
  ~TextLines();

  /// The first `n` bytes (fewer if the file is shorter), inflated, without consuming them. Only before the
  /// first next().
  Result<std::string> peek(std::size_t n);
  /// False at the end. Error, once: the compressed data is damaged or truncated, or a line is longer than 16
  /// MiB; the incomplete line is dropped and the end follows.
  Result<bool> next(std::string& line);
  /// Of the last line from next(), from 1.
  std::uint64_t number() const;
  /// False: the file ended inside the last line from next().
  bool ended_by_break() const;
  /// Bytes read of the file on disk, and its size.
  double bytes_read() const;
  double bytes_total() const;

 private:
  struct State;
  explicit TextLines(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools

// A file that may be gzip-compressed, with a seekable position in the inflated bytes; seeking back up to 8
// MiB is cheap.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

struct gzFile_s;

namespace parhelion::tools {

class GzipFile {
 public:
  explicit GzipFile(const std::string& path);
  GzipFile(const GzipFile&) = delete;
  GzipFile& operator=(const GzipFile&) = delete;
  ~GzipFile();

  bool is_open() const { return file_ != nullptr; }
  /// Returns fewer bytes at the end or at damaged compressed data.
  std::size_t read(void* buffer, std::size_t count);
  /// -1 at the end or at damaged compressed data.
  int next_byte();
  void seek(std::uint64_t position);
  std::uint64_t position() const;
  /// Position in the file on disk.
  std::uint64_t compressed_position() const;
  bool damaged() const;

  /// True if the file is compressed and its checksum is correct.
  static bool intact(const std::string& path);

 private:
  bool fill();

  gzFile_s* file_;
  std::vector<char> window_;  ///< inflated bytes, starting at base_
  std::uint64_t base_ = 0;
  std::size_t at_ = 0;  ///< in window_
};

}  // namespace parhelion::tools

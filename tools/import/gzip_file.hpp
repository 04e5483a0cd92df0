// A file that may be gzip-compressed, with a position in the inflated bytes that can go back: cheaply by up
// to 8 MiB.
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
  /// Fewer at the end or where the compressed data is damaged.
  std::size_t read(void* buffer, std::size_t count);
  /// -1 at the end or where the compressed data is damaged.
  int next_byte();
  void seek(std::uint64_t position);
  std::uint64_t position() const;
  /// In the file as it lies on disk.
  std::uint64_t compressed_position() const;
  bool damaged() const;

  /// Whether the file is compressed and its checksum says that nothing changed since it was written.
  static bool intact(const std::string& path);

 private:
  bool fill();

  gzFile_s* file_;
  std::vector<char> window_;  ///< inflated bytes from base_ on
  std::uint64_t base_ = 0;
  std::size_t at_ = 0;  ///< in window_
};

}  // namespace parhelion::tools

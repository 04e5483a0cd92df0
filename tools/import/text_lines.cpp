#include "tools/import/text_lines.hpp"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

namespace parhelion::tools {
namespace {

constexpr std::size_t kChunkBytes = 1U << 16;
constexpr std::size_t kLongestLine = 16U << 20;
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors write it before the first line

/// Source of inflated bytes.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Reads up to `size` bytes; 0: the end; below 0: damaged or truncated.
  virtual long read(char* buffer, std::size_t size) = 0;
  virtual double position() const = 0;
};

/// gzip and uncompressed files.
class GzipSource final : public ByteSource {
 public:
  explicit GzipSource(gzFile file) : file_(file) {}
  GzipSource(const GzipSource&) = delete;
  GzipSource& operator=(const GzipSource&) = delete;
  ~GzipSource() override { gzclose(file_); }
  long read(char* buffer, std::size_t size) override {
    const int got = gzread(file_, buffer, static_cast<unsigned>(size));
    if (got > 0) return got;
    int code = Z_OK;
    gzerror(file_, &code);
    return code == Z_OK || code == Z_STREAM_END ? got : -1;
  }
  double position() const override { return static_cast<double>(gzoffset(file_)); }

 private:
  gzFile file_;
};

class Bzip2Source final : public ByteSource {
 public:
  explicit Bzip2Source(std::FILE* file) : file_(file) { begin(); }
  Bzip2Source(const Bzip2Source&) = delete;
  Bzip2Source& operator=(const Bzip2Source&) = delete;
  ~Bzip2Source() override {
    BZ2_bzDecompressEnd(&stream_);
    std::fclose(file_);
  }
  long read(char* buffer, std::size_t size) override {
    stream_.next_out = buffer;
    stream_.avail_out = static_cast<unsigned>(size);
    while (stream_.avail_out == size) {
      if (stream_.avail_in == 0 && !fill()) return ended_ ? 0 : -1;
      const int code = BZ2_bzDecompress(&stream_);
      ended_ = code == BZ_STREAM_END;
      if (code != BZ_OK && !ended_) return -1;
      // Another stream may follow (pbzip2 writes several).
      if (ended_ && (stream_.avail_in > 0 || fill())) restart();
      if (ended_) break;
    }
    return static_cast<long>(size - stream_.avail_out);
  }
  double position() const override { return static_cast<double>(read_); }

 private:
  void begin() {
    stream_ = bz_stream{};
    BZ2_bzDecompressInit(&stream_, 0, 0);
  }
  void restart() {
    bz_stream next{};
    next.next_in = stream_.next_in;
    next.avail_in = stream_.avail_in;
    next.next_out = stream_.next_out;
    next.avail_out = stream_.avail_out;
    BZ2_bzDecompressEnd(&stream_);
    BZ2_bzDecompressInit(&next, 0, 0);
    stream_ = next;
    ended_ = false;
  }
  bool fill() {
    const std::size_t got = std::fread(input_.data(), 1, input_.size(), file_);
    stream_.next_in = input_.data();
    stream_.avail_in = static_cast<unsigned>(got);
    read_ += got;
    return got > 0;
  }

  std::FILE* file_;
  bz_stream stream_{};
  std::array<char, kChunkBytes> input_{};
  std::uint64_t read_ = 0;
  bool ended_ = false;
};

std::unique_ptr<ByteSource> open_bytes(const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return nullptr;
  char magic[3] = {};
  const std::size_t got = std::fread(magic, 1, sizeof magic, file);
  std::rewind(file);
  if (got == sizeof magic && std::memcmp(magic, "BZh", 3) == 0) return std::make_unique<Bzip2Source>(file);
  std::fclose(file);
  gzFile gzip = gzopen(path.c_str(), "rb");
  return gzip == nullptr ? nullptr : std::make_unique<GzipSource>(gzip);
}

}  // namespace

struct TextLines::State {
  std::string path;
  double total = 0;
  std::unique_ptr<ByteSource> bytes;
  std::string buffer;
  std::size_t taken = 0;  ///< of buffer
  std::uint64_t number = 0;
  bool at_end = false, damaged = false, ended_by_break = true;

  void fill() {
    buffer.erase(0, std::exchange(taken, 0));
    const std::size_t before = buffer.size();
    buffer.resize(before + kChunkBytes);
    const long got = bytes->read(buffer.data() + before, kChunkBytes);
    buffer.resize(before + static_cast<std::size_t>(std::max(got, 0L)));
    at_end = got <= 0;
    damaged = got < 0;
  }

  Error damage(const std::string& what) {
    at_end = true;
    damaged = false;
    buffer.clear();
    taken = 0;
    return Error{path + ":" + std::to_string(number + 1) + ": " + what};
  }
};

TextLines::TextLines(std::unique_ptr<State> state) : state_(std::move(state)) {}
TextLines::TextLines(TextLines&&) noexcept = default;
TextLines& TextLines::operator=(TextLines&&) noexcept = default;
TextLines::~TextLines() = default;

Result<TextLines> TextLines::open(const std::filesystem::path& path) {
  auto state = std::make_unique<State>();
  state->path = path.string();
  state->bytes = open_bytes(state->path);
  if (!state->bytes) return Error{state->path + ": cannot be opened: " + std::strerror(errno)};
  std::error_code ignored;
  state->total = static_cast<double>(std::filesystem::file_size(path, ignored));
  state->fill();
  if (state->buffer.starts_with(kByteOrderMark)) state->taken = kByteOrderMark.size();
  return TextLines(std::move(state));
}

Result<std::string> TextLines::peek(std::size_t n) {
  while (state_->buffer.size() - state_->taken < n && !state_->at_end) state_->fill();
  if (state_->damaged && state_->buffer.empty()) return state_->damage("the compressed data is damaged");
  return state_->buffer.substr(state_->taken, n);
}

Result<bool> TextLines::next(std::string& line) {
  State& s = *state_;
  std::size_t searched = s.taken;
  for (;;) {
    const std::size_t end = s.buffer.find('\n', searched);
    if (end != std::string::npos) {
      line.assign(s.buffer, s.taken, end - s.taken);
      s.taken = end + 1;
      ++s.number;
      s.ended_by_break = true;
      return true;
    }
    if (s.damaged)
      return s.damage("the compressed data is damaged or truncated here; the rest cannot be read");
    if (s.at_end) break;
    if (s.buffer.size() - s.taken > kLongestLine) return s.damage("a line longer than 16 MiB");
    searched = s.buffer.size() - s.taken;
    s.fill();
  }
  if (s.taken == s.buffer.size()) return false;
  line = s.buffer.substr(s.taken);
  s.taken = s.buffer.size();
  ++s.number;
  s.ended_by_break = false;
  return true;
}

std::uint64_t TextLines::number() const { return state_->number; }
bool TextLines::ended_by_break() const { return state_->ended_by_break; }
double TextLines::bytes_read() const { return state_->bytes->position(); }
double TextLines::bytes_total() const { return state_->total; }

}  // namespace parhelion::tools

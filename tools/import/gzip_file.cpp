#include "tools/import/gzip_file.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstring>

namespace parhelion::tools {

GzipFile::GzipFile(const std::string& path) : file_(gzopen(path.c_str(), "rb")) {
  if (file_ != nullptr) gzbuffer(file_, 1U << 18);
}

GzipFile::~GzipFile() {
  if (file_ != nullptr) gzclose(file_);
}

bool GzipFile::fill() {
  constexpr std::size_t chunk = 1U << 18, history = 8U << 20;
  if (at_ > 2 * history) {
    const std::size_t forgotten = at_ - history;
    window_.erase(window_.begin(), window_.begin() + static_cast<std::ptrdiff_t>(forgotten));
    base_ += forgotten;
    at_ -= forgotten;
  }
  const std::size_t before = window_.size();
  window_.resize(before + chunk);
  const int got = gzread(file_, window_.data() + before, static_cast<unsigned>(chunk));
  window_.resize(before + static_cast<std::size_t>(std::max(got, 0)));
  return got > 0;
}

std::size_t GzipFile::read(void* buffer, std::size_t count) {
  std::size_t done = 0;
  while (done < count && (at_ < window_.size() || fill())) {
    const std::size_t n = std::min(count - done, window_.size() - at_);
    std::memcpy(static_cast<char*>(buffer) + done, window_.data() + at_, n);
    at_ += n;
    done += n;
  }
  return done;
}

int GzipFile::next_byte() {
  if (at_ == window_.size() && !fill()) return -1;
  return static_cast<unsigned char>(window_[at_++]);
}

void GzipFile::seek(std::uint64_t position) {
  if (position < base_) {
    gzrewind(file_);
    window_.clear();
    base_ = 0;
    at_ = 0;
  }
  while (position > base_ + window_.size() && fill()) at_ = window_.size();
  at_ = static_cast<std::size_t>(std::min<std::uint64_t>(position - base_, window_.size()));
}

std::uint64_t GzipFile::position() const { return base_ + at_; }
std::uint64_t GzipFile::compressed_position() const { return static_cast<std::uint64_t>(gzoffset(file_)); }

bool GzipFile::damaged() const {
  int code = Z_OK;
  gzerror(file_, &code);
  return code != Z_OK && code != Z_STREAM_END;
}

bool GzipFile::intact(const std::string& path) {
  GzipFile file(path);
  if (!file.is_open()) return false;
  std::vector<char> buffer(1U << 18);
  while (gzread(file.file_, buffer.data(), static_cast<unsigned>(buffer.size())) > 0) {
  }
  return gzdirect(file.file_) == 0 && !file.damaged();
}

}  // namespace parhelion::tools

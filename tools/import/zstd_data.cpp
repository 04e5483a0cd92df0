#include "tools/import/zstd_data.hpp"

#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>

namespace parhelion::tools {
namespace {

struct FreeStream {
  void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
};
using Stream = std::unique_ptr<ZSTD_DStream, FreeStream>;

constexpr const char* kDamaged = "its zstd data is damaged or cut off";

}  // namespace

bool is_zstd(std::span<const std::uint8_t> bytes) {
  constexpr std::uint8_t magic[] = {0x28, 0xB5, 0x2F, 0xFD};
  return bytes.size() >= sizeof magic && std::memcmp(bytes.data(), magic, sizeof magic) == 0;
}

Status inflate_zstd(std::span<const std::uint8_t> bytes, std::size_t limit, std::vector<std::uint8_t>& out) {
  out.clear();
  const Stream stream(ZSTD_createDStream());
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  const std::size_t step = ZSTD_DStreamOutSize();
  std::size_t expects = 1;  // 0: the frame has ended
  while (expects != 0 || in.pos < in.size) {
    const std::size_t before = out.size();
    if (before > limit) return Error{"it holds more than the " + std::to_string(limit) + " bytes expected"};
    out.resize(before + step);
    ZSTD_outBuffer room{out.data() + before, step, 0};
    expects = ZSTD_decompressStream(stream.get(), &room, &in);
    const bool failed = ZSTD_isError(expects) != 0;
    out.resize(before + (failed ? 0 : room.pos));
    if (failed || (expects != 0 && in.pos == in.size && room.pos == 0)) return Error{kDamaged};
  }
  if (out.size() > limit) return Error{"it holds more than the " + std::to_string(limit) + " bytes expected"};
  return {};
}

Status inflate_message(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& out) {
  constexpr std::size_t largest = std::size_t{1} << 30U;
  return inflate_zstd(bytes, largest, out);
}

Status inflate_zstd_file(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream in(from, std::ios::binary);
  std::ofstream out(to, std::ios::binary);
  if (!in) return Error{from.string() + ": cannot be opened: " + std::strerror(errno)};
  std::error_code ignored;
  constexpr std::uintmax_t kept_free = std::uintmax_t{1} << 30U;
  const std::uintmax_t available = std::filesystem::space(to.parent_path(), ignored).available;
  std::uintmax_t written_bytes = 0;
  const Stream stream(ZSTD_createDStream());
  std::vector<char> read(ZSTD_DStreamInSize()), written(ZSTD_DStreamOutSize());
  std::size_t expects = 0;
  while (in.read(read.data(), static_cast<std::streamsize>(read.size())), in.gcount() > 0) {
    ZSTD_inBuffer bytes{read.data(), static_cast<std::size_t>(in.gcount()), 0};
    while (bytes.pos < bytes.size) {
      ZSTD_outBuffer room{written.data(), written.size(), 0};
      expects = ZSTD_decompressStream(stream.get(), &room, &bytes);
      if (ZSTD_isError(expects) != 0) return Error{from.string() + ": " + kDamaged};
      written_bytes += room.pos;
      if (written_bytes + kept_free > available)
        return Error{from.string() + ": too large to be inflated in " + to.parent_path().string() +
                     ": inflate it elsewhere (zstd -d), or set TMPDIR"};
      out.write(written.data(), static_cast<std::streamsize>(room.pos));
    }
  }
  out.flush();
  if (!out) return Error{to.string() + ": cannot be written: " + std::strerror(errno)};
  if (expects != 0) return Error{from.string() + ": " + kDamaged};
  return {};
}

}  // namespace parhelion::tools

#include "tools/import/bag_chunk.hpp"

#include <bzlib.h>
#include <lz4frame.h>

#include <algorithm>
#include <cstring>

namespace parhelion::tools {
namespace {

constexpr std::size_t kStepBytes = 1U << 20;

std::uint32_t little_endian(const std::uint8_t* p) {
  return p[0] | (std::uint32_t{p[1]} << 8) | (std::uint32_t{p[2]} << 16) | (std::uint32_t{p[3]} << 24);
}

Status inflate_bz2(std::span<const std::uint8_t> bytes, std::uint32_t size, std::vector<std::uint8_t>& out) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) return Error{"bzip2 cannot be initialized"};
  // bzip2's interface has no const.
  stream.next_in = reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data()));
  stream.avail_in = static_cast<unsigned>(bytes.size());
  int code = BZ_OK;
  while (code == BZ_OK && out.size() < size) {
    const std::size_t before = out.size();
    out.resize(before + std::min<std::size_t>(kStepBytes, size - before));
    stream.next_out = reinterpret_cast<char*>(out.data() + before);
    stream.avail_out = static_cast<unsigned>(out.size() - before);
    code = BZ2_bzDecompress(&stream);
    const bool stuck = code == BZ_OK && stream.avail_in == 0 && stream.avail_out > 0;
    out.resize(out.size() - stream.avail_out);
    if (stuck) break;
  }
  // The checksum follows the last byte.
  if (code == BZ_OK) {
    char beyond = 0;
    stream.next_out = &beyond;
    stream.avail_out = 1;
    code = BZ2_bzDecompress(&stream);
  }
  BZ2_bzDecompressEnd(&stream);
  if (code != BZ_STREAM_END) return Error{"its bzip2 data is damaged"};
  return {};
}

Status inflate_lz4(std::span<const std::uint8_t> bytes, std::uint32_t size, std::vector<std::uint8_t>& out) {
  LZ4F_decompressionContext_t context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0)
    return Error{"lz4 cannot be initialized"};
  std::size_t taken = 0, hint = 1;
  bool failed = false;
  while (hint != 0 && !failed && taken < bytes.size() && out.size() <= size) {
    const std::size_t before = out.size();
    std::size_t room = std::min<std::size_t>(kStepBytes, size - before + 1), input = bytes.size() - taken;
    out.resize(before + room);
    hint = LZ4F_decompress(context, out.data() + before, &room, bytes.data() + taken, &input, nullptr);
    failed = LZ4F_isError(hint) != 0;
    out.resize(before + (failed ? 0 : room));
    taken += failed ? 0 : input;
  }
  LZ4F_freeDecompressionContext(context);
  if (failed || hint != 0) return Error{"its lz4 data is damaged"};
  return {};
}

}  // namespace

std::optional<BagFields> parse_bag_fields(std::span<const std::uint8_t> bytes) {
  BagFields fields;
  for (std::size_t at = 0; at < bytes.size();) {
    if (bytes.size() - at < 4) return std::nullopt;
    const std::size_t length = little_endian(bytes.data() + at);
    at += 4;
    if (length > bytes.size() - at) return std::nullopt;
    const auto field = bytes.subspan(at, length);
    const auto equals = std::find(field.begin(), field.end(), std::uint8_t{'='});
    if (equals == field.end()) return std::nullopt;
    const auto name_size = static_cast<std::size_t>(equals - field.begin());
    fields[std::string(field.begin(), equals)] = field.subspan(name_size + 1);
    at += length;
  }
  return fields;
}

template <class T>
std::optional<T> bag_number(const BagFields& fields, const char* name) {
  const auto found = fields.find(name);
  if (found == fields.end() || found->second.size() != sizeof(T)) return std::nullopt;
  T value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i)
    value = static_cast<T>(value | (T{found->second[i]} << (8 * i)));
  return value;
}
template std::optional<std::uint8_t> bag_number(const BagFields&, const char*);
template std::optional<std::uint32_t> bag_number(const BagFields&, const char*);
template std::optional<std::uint64_t> bag_number(const BagFields&, const char*);

std::string bag_text(const BagFields& fields, const char* name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string() : std::string(found->second.begin(), found->second.end());
}

Status inflate_chunk(const std::string& compression, std::span<const std::uint8_t> bytes, std::uint32_t size,
                     std::vector<std::uint8_t>& out) {
  out.clear();
  Status done;
  if (compression == "none") {
    out.assign(bytes.begin(), bytes.end());
  } else if (compression == "bz2") {
    done = inflate_bz2(bytes, size, out);
  } else if (compression == "lz4") {
    done = inflate_lz4(bytes, size, out);
  } else {
    return Error{"its compression is '" + compression.substr(0, 20) + "'; expected none, bz2 or lz4"};
  }
  if (done.ok() && out.size() != size) {
    return Error{"it holds " + std::to_string(out.size()) + " bytes, " + std::to_string(size) +
                 " were announced"};
  }
  return done;
}

}  // namespace parhelion::tools

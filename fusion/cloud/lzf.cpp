#include "fusion/cloud/lzf.hpp"

#include <cstring>

namespace parhelion::cloud {
namespace {

/// A stream that is being decompressed; every step checks both buffers.
struct Stream {
  std::string_view in;
  std::string& out;
  std::size_t read = 0, written = 0;

  bool literals(std::size_t count) {
    if (count > in.size() - read || count > out.size() - written) return false;
    std::memcpy(out.data() + written, in.data() + read, count);
    read += count;
    written += count;
    return true;
  }
  /// Copies from `distance` back; source and destination may overlap.
  bool repeat(std::size_t distance, std::size_t count) {
    if (distance > written || count > out.size() - written) return false;
    char* to = out.data() + written;
    for (std::size_t i = 0; i < count; ++i) to[i] = (to - distance)[i];
    written += count;
    return true;
  }
  std::size_t byte() { return static_cast<unsigned char>(in[read++]); }
};

bool step(Stream& stream) {
  const std::size_t control = stream.byte();
  if (control < 32) return stream.literals(control + 1);
  std::size_t count = control >> 5;
  if (stream.in.size() - stream.read < (count == 7 ? 2U : 1U)) return false;
  if (count == 7) count += stream.byte();
  const std::size_t distance = ((control & 31) << 8) + stream.byte() + 1;
  return stream.repeat(distance, count + 2);
}

}  // namespace

Result<std::string> lzf_decompress(std::string_view compressed, std::size_t size) {
  std::string out(size, '\0');
  Stream stream{compressed, out};
  while (stream.read < compressed.size()) {
    const std::size_t at = stream.read;
    if (!step(stream)) {
      return Error{"LZF: byte " + std::to_string(at) + " of the compressed block refers outside of it"};
    }
  }
  if (stream.written != size) {
    return Error{"LZF: the block unpacks to " + std::to_string(stream.written) + " bytes, expected " +
                 std::to_string(size)};
  }
  return out;
}

}  // namespace parhelion::cloud

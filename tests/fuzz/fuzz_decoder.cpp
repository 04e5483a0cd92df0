// Every decoder on hostile bytes: it refuses, or gives a message that can be written and read again.
#include <cstdlib>

#include "protocols/authentication/signature.hpp"
#include "tests/protocols/codec_samples.hpp"

namespace {

using parhelion::test::Sample;

/// The first byte chooses the type; its top bit, whether the rest is laid over a good message or follows a
/// fingerprint.
std::vector<std::uint8_t> message_from(const Sample& sample, parhelion::Bytes input) {
  const bool over_good = (input[0] & 0x80) != 0;
  const parhelion::Bytes rest = input.subspan(1);
  std::vector<std::uint8_t> bytes = sample.bytes;
  if (!over_good) {
    bytes.resize(8);
    bytes.insert(bytes.end(), rest.begin(), rest.end());
    return bytes;
  }
  for (std::size_t i = 0; i < rest.size(); ++i) {
    if (8 + i < bytes.size()) {
      bytes[8 + i] ^= rest[i];
    } else {
      bytes.push_back(rest[i]);
    }
  }
  return bytes;
}

/// Written again, a message has the size that was read, less a signature: decoders ignore it.
bool has_size_of(parhelion::Bytes again, parhelion::Bytes read) {
  using parhelion::kSignatureSize;
  return again.size() == read.size() ||
         (again.size() + kSignatureSize == read.size() && parhelion::looks_signed(read.last(kSignatureSize)));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<Sample> samples = parhelion::test::samples();
  if (size == 0) return 0;
  const Sample& sample = samples[(data[0] & 0x7f) % samples.size()];
  const auto bytes = message_from(sample, {data, size});
  (void)parhelion::describe("FUZZ", bytes);
  (void)parhelion::describe("FUZZ", {data, size});
  if (!sample.decode(bytes)) return 0;
  const auto again = sample.encode_again();
  // What an MBot sends is written as imu_t: only that may have another size.
  const bool same_type = sample.written_as == sample.type;
  if ((same_type && !has_size_of(again, bytes)) || !sample.decode(again)) std::abort();
  return 0;
}

// The log reader on hostile files: it ends, accounts for every byte, and what it returns could have been
// written.
#include <cstdlib>

#include "protocols/bus/log_file.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/protocols/codec_samples.hpp"

namespace {

std::vector<std::uint8_t> good_log() {
  std::vector<std::uint8_t> log;
  for (const auto& sample : parhelion::test::samples()) {
    const std::string channel = sample.type;
    const auto put = [&log](std::uint64_t value, int bytes) {
      for (int i = bytes - 1; i >= 0; --i) log.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    };
    put(0xEDA1DA01, 4);
    put(0, 8);
    put(1'000'000, 8);
    put(channel.size(), 4);
    put(sample.bytes.size(), 4);
    log.insert(log.end(), channel.begin(), channel.end());
    log.insert(log.end(), sample.bytes.begin(), sample.bytes.end());
  }
  return log;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const parhelion::fuzz::MemoryFile file;
  static const std::vector<std::uint8_t> good = good_log();
  std::vector<std::uint8_t> log(data, data + size);
  // Half of the inputs are laid over a good log, from an offset that they choose.
  if (size > 3 && (data[0] & 1) != 0) {
    log = good;
    const std::size_t offset = (data[1] << 8 | data[2]) % log.size();
    for (std::size_t i = 3; i < size && offset + i - 3 < log.size(); ++i) log[offset + i - 3] ^= data[i];
    if ((data[0] & 2) != 0) log.resize(offset);
  }
  auto reader = parhelion::LogReader::open(file.hold(log));
  if (!reader || reader->size() != log.size()) std::abort();
  std::uint64_t events = 0, offset = 0;
  while (true) {
    const auto event = reader->next();
    if (event && !event->has_value()) break;
    if (reader->offset() <= offset) std::abort();
    offset = reader->offset();
    if (event) events += 28 + (*event)->channel.size() + (*event)->payload.size();
  }
  if (reader->offset() != log.size() || events + reader->skipped_bytes() != log.size()) std::abort();
  return 0;
}

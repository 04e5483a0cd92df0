// hazard_reading_t.
#include "parhelion/hazard_reading_t.hpp"
#include "protocols/codec.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxValues = 16;

}  // namespace

Status decode(std::string_view channel, Bytes bytes, HazardReading& reading) {
  wire::Reader reader(channel, "hazard_reading_t", hazard_reading_t::getHash(), bytes);
  reading.stamp = reader.utime();
  reading.values.resize(reader.count("nvalues", sizeof(std::int8_t) + sizeof(double), kMaxValues));
  for (HazardReading::Value& value : reading.values) {
    value.kind = reader.enumeration("kinds", HazardKind::gas);
    reader.check_range("kinds", static_cast<std::int64_t>(value.kind), 1, 2);
  }
  for (HazardReading::Value& value : reading.values) {
    value.value = reader.bounded<double>("values", 1e15);
    reader.check_range("values", value.value < 0 ? -1 : 0, 0, 0);
  }
  for (HazardReading::Value& value : reading.values) reader.text("units", value.unit);
  return reader.status();
}

void encode(const HazardReading& reading, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(hazard_reading_t::getHash(), bytes);
  writer.number(reading.stamp.utime());
  writer.count(reading.values.size());
  for (const HazardReading::Value& value : reading.values) writer.enumeration(value.kind);
  for (const HazardReading::Value& value : reading.values) writer.number(value.value);
  for (const HazardReading::Value& value : reading.values) writer.text(value.unit);
}

}  // namespace parhelion

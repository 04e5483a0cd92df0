// The readers of YAML on any bytes: no crash, no hang; what they accept, they write and read back.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"

namespace {

template <class Read>
void read_write_read(const std::string& text, Read read) {
  const auto first = read(text);
  if (!first) {
    if (first.error().message.empty()) std::abort();
    return;
  }
  const std::string written = parhelion::to_yaml(*first);
  const auto second = read(written);
  if (!second || parhelion::to_yaml(*second) != written) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  read_write_read(text, [](const std::string& yaml) { return parhelion::parse_scenario(yaml, "fuzz"); });
  read_write_read(text, [](const std::string& yaml) { return parhelion::parse_model(yaml, "fuzz"); });
  read_write_read(text,
                  [](const std::string& yaml) { return parhelion::parse_robot_description(yaml, "fuzz"); });
  return 0;
}

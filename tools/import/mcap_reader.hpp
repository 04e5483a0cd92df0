// Reads MCAP recordings (https://mcap.dev/spec) in file order. It needs no index, so it reads recordings that
// are cut off, and it checks every length before allocating memory. Debian 12 has no library for MCAP.
#pragma once

#include <filesystem>
#include <memory>

#include "tools/import/bag_source.hpp"

namespace parhelion::tools {

class McapReader final : public BagSource {
 public:
  /// Error: not readable, or no MCAP file.
  static Result<std::unique_ptr<BagSource>> open(const std::filesystem::path& path);
  ~McapReader() override;

  /// The error contains the offset of the damage. A damaged chunk is skipped; where the file itself is
  /// damaged or cut off reading ends.
  Result<bool> next(BagMessage& message) override;
  std::uint64_t messages() const override;
  double done() const override;
  double total() const override;

 private:
  struct State;
  explicit McapReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools

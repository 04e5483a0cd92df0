// Reads the SQLite databases of ROS 2 recordings (rosbag2, storage sqlite3, schemas 1 to 4), by receive time.
#pragma once

#include <filesystem>
#include <memory>

#include "tools/import/bag_source.hpp"

namespace parhelion::tools {

class BagDatabase final : public BagSource {
 public:
  /// The file is not changed, and what is beside it is not read. Error: no such database.
  static Result<std::unique_ptr<BagSource>> open(const std::filesystem::path& path);
  ~BagDatabase() override;

  /// Reading ends with the first error.
  Result<bool> next(BagMessage& message) override;
  std::uint64_t messages() const override;
  double done() const override;
  double total() const override;

 private:
  struct State;
  explicit BagDatabase(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools

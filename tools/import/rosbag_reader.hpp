// Reads ROS 1 bags record by record (http://wiki.ros.org/Bags/Format/2.0), in file order. Unlike librosbag it
// needs no index, so it reads truncated bags, and it checks every count in the file before allocating memory.
#pragma once

#include <filesystem>
#include <memory>

#include "tools/import/bag_source.hpp"

namespace parhelion::tools {

class BagReader final : public BagSource {
 public:
  static Result<BagReader> open(const std::filesystem::path& path);
  BagReader(BagReader&&) noexcept;
  BagReader& operator=(BagReader&&) noexcept;
  ~BagReader() override;

  /// The error contains the offset of the damage; reading resumes behind it.
  Result<bool> next(BagMessage& message) override;
  std::uint64_t messages() const override;
  double done() const override;
  double total() const override;

 private:
  struct State;
  explicit BagReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace parhelion::tools

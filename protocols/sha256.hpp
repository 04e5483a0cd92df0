// Incremental SHA-256 (FIPS 180-4).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace parhelion {

class Sha256 {
 public:
  Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;
  ~Sha256();

  void add(std::span<const std::uint8_t> bytes);
  /// Lower-case hex of all bytes so far; more may be added afterwards.
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace parhelion

// Messages that the bus refused by their signatures.
#pragma once

#include <cstdint>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocols/authentication/signed_bus.hpp"

namespace parhelion::runtime {

/// From the receiving thread to the loop. Thread-safe.
class RefusedMessages {
 public:
  struct First {
    SignatureFault fault;
    std::string channel, sender;  ///< sender: as the message says; empty: unknown
  };

  void add(const RefusedMessage& message);
  /// The first message of each fault on each channel, once; the agents' channels are one, "MR_AGENT_*".
  std::vector<First> take();
  std::uint64_t count() const;

 private:
  static constexpr std::size_t kMaxKinds = 1024;  // faults times channels; further ones are only counted

  mutable std::mutex mutex_;
  std::set<std::pair<SignatureFault, std::string>> known_;
  std::vector<First> news_;
  std::uint64_t count_ = 0;
};

}  // namespace parhelion::runtime

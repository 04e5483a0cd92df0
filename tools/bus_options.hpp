// --url and --keys of the commands that use the bus.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "protocols/authentication/signed_bus.hpp"
#include "protocols/bus/bus.hpp"

namespace parhelion::tools {

struct BusOptions {
  std::string url;
  std::string keys;  ///< path; empty: nothing is signed or verified

  void add_to(CLI::App& command);
  /// `refused`: see sign(). `hosts`: without keys, see open_network_bus().
  Result<std::unique_ptr<Bus>> open(std::function<void(const RefusedMessage&)> refused,
                                    std::optional<OtherHosts> hosts = {}) const;
  /// Tells `command`'s user of the first message refused for each reason.
  Result<std::unique_ptr<Bus>> open(const std::string& command) const;
  /// For publishing only.
  Result<std::unique_ptr<Bus>> open_speaker() const;

 private:
  Result<std::unique_ptr<Bus>> with_keys(Result<std::unique_ptr<Bus>> bus,
                                         std::function<void(const RefusedMessage&)> refused) const;
};

}  // namespace parhelion::tools

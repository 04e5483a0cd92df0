#include "tools/bus_options.hpp"

#include <cstdio>
#include <set>

#include "protocols/bus/network_speaker.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::tools {

void BusOptions::add_to(CLI::App& command) {
  command.add_option("--url", url, "LCM URL; by default LCM_DEFAULT_URL, else this machine only");
  command
      .add_option("--keys", keys,
                  "Keys of `parhelion key new`: sign what is sent, and accept only what their senders signed")
      ->envname("PARHELION_KEYS");
}

Result<std::unique_ptr<Bus>> BusOptions::open(std::function<void(const RefusedMessage&)> refused,
                                              std::optional<OtherHosts> hosts) const {
  if (!keys.empty()) hosts.reset();
  return with_keys(open_network_bus(url, std::move(hosts)), std::move(refused));
}

Result<std::unique_ptr<Bus>> BusOptions::open(const std::string& command) const {
  return open([command, reported = std::set<SignatureFault>()](const RefusedMessage& message) mutable {
    if (!reported.insert(message.fault).second) return;
    std::fprintf(stderr, "parhelion %s: a message on %s was %s: refused\n", command.c_str(),
                 yaml::printable(message.channel).c_str(), to_string(message.fault));
  });
}

Result<std::unique_ptr<Bus>> BusOptions::open_speaker() const {
  return with_keys(open_network_speaker(url), {});
}

Result<std::unique_ptr<Bus>> BusOptions::with_keys(Result<std::unique_ptr<Bus>> bus,
                                                   std::function<void(const RefusedMessage&)> refused) const {
  if (!bus || keys.empty()) return bus;
  const auto loaded = load_keys(keys);
  if (!loaded) return loaded.error();
  return sign(std::move(*bus), *loaded, std::move(refused));
}

}  // namespace parhelion::tools

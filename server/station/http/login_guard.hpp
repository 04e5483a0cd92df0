// Rate limit for log-in attempts.
#pragma once

#include <map>
#include <string>

#include "protocols/time.hpp"

namespace parhelion::station {

/// Failed attempts cost a wait that doubles, for the name and for the address. Not thread-safe; instants of a
/// monotonic clock.
class LoginGuard {
 public:
  /// Zero: go ahead; the attempt counts as failed until succeeded(). Above zero: time to wait; attempts
  /// meanwhile do not extend it. `network`: of the peer (network_of).
  Duration admit(const std::string& network, const std::string& name, WallTime now);
  /// Clears the last failure of both.
  void succeeded(const std::string& network, const std::string& name);

 private:
  struct Record {
    unsigned failed = 0;
    WallTime last, until;
  };
  /// A classroom shares an address and mistypes; a name is one person, whom others must not lock out for
  /// long.
  struct Rule {
    unsigned free;
    Duration longest;
  };
  static constexpr Rule kNameRule{5, seconds(60.0)}, kNetworkRule{30, seconds(900.0)};

  using Records = std::map<std::string, Record>;
  static Duration wait(const Records& records, const std::string& key, WallTime now);
  static void count(Records& records, const std::string& key, const Rule& rule, WallTime now);

  Records names_, networks_;
};

}  // namespace parhelion::station

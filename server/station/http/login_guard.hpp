// How often somebody may try to log in.
#pragma once

#include <map>
#include <string>

#include "protocols/time.hpp"

namespace parhelion::station {

/// Tries that fail cost a wait that doubles, for the name and for the address. Not thread-safe; instants of a
/// clock that never goes back.
class LoginGuard {
 public:
  /// Zero: go ahead, and the try counts as failed until succeeded(). Above zero: come back after so long;
  /// asking meanwhile makes it no longer. `network`: of the other end (network_of).
  Duration admit(const std::string& network, const std::string& name, WallTime now);
  /// The last try of both did not fail.
  void succeeded(const std::string& network, const std::string& name);

 private:
  struct Record {
    unsigned failed = 0;
    WallTime last, until;
  };
  /// A classroom shares an address and mistypes; a name is one person, who must not be locked out for long by
  /// others.
  struct Rule {
    unsigned free;
    Duration longest;
  };
  static constexpr Rule name_rule{5, seconds(60.0)}, network_rule{30, seconds(900.0)};

  using Records = std::map<std::string, Record>;
  static Duration wait(const Records& records, const std::string& key, WallTime now);
  static void count(Records& records, const std::string& key, const Rule& rule, WallTime now);

  Records names_, networks_;
};

}  // namespace parhelion::station

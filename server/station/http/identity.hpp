// Identity and roles of a client.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

namespace parhelion::station {

enum class Role : std::uint8_t { observer, trainee, instructor, admin };

/// "observer", "trainee", "instructor", "admin".
std::string_view role_name(Role role);
/// nullopt: no such role.
std::optional<Role> role_of(std::string_view word);

struct Identity {
  std::string name;  ///< of the account: letters, digits, '_', '-' and '.'
  Role role = Role::observer;
};

/// The roles that may use a route.
class Access {
 public:
  /// Includes clients that are not logged in.
  static Access everyone();
  static Access logged_in();
  static Access only(std::initializer_list<Role> roles);
  /// The same, and any client on this machine, logged in or not.
  Access or_local() const;

  /// `who`: nullptr if nobody is logged in; `local`: from this machine.
  bool allows(const Identity* who, bool local) const;

 private:
  bool everyone_ = false, local_ = false;
  unsigned roles_ = 0;  ///< a bit for each role
};

}  // namespace parhelion::station

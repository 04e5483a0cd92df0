#include "server/station/http/identity.hpp"

#include <array>

namespace parhelion::station {
namespace {

constexpr std::array<std::string_view, 4> kRoleNames = {"observer", "trainee", "instructor", "admin"};

unsigned bit(Role role) { return 1U << static_cast<unsigned>(role); }

}  // namespace

std::string_view role_name(Role role) { return kRoleNames.at(static_cast<std::size_t>(role)); }

std::optional<Role> role_of(std::string_view word) {
  for (std::size_t i = 0; i < kRoleNames.size(); ++i) {
    if (kRoleNames[i] == word) return static_cast<Role>(i);
  }
  return std::nullopt;
}

Access Access::everyone() {
  Access access;
  access.everyone_ = true;
  return access;
}

Access Access::logged_in() { return only({Role::observer, Role::trainee, Role::instructor, Role::admin}); }

Access Access::only(std::initializer_list<Role> roles) {
  Access access;
  for (const Role role : roles) access.roles_ |= bit(role);
  return access;
}

Access Access::or_local() const {
  Access access = *this;
  access.local_ = true;
  return access;
}

bool Access::allows(const Identity* who, bool local) const {
  return everyone_ || (local_ && local) || (who && (roles_ & bit(who->role)) != 0);
}

}  // namespace parhelion::station

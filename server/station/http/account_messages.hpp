// Parses account messages of pages. The JSON is untrusted.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "protocols/status.hpp"
#include "server/station/http/identity.hpp"

namespace parhelion::station {

struct LoginMessage {
  std::string name, password;
};
struct SetupMessage {
  std::string token, name, password;
};
struct AccountMessage {
  std::string name;
  std::optional<Role> role;
  std::optional<std::string> password;
};

struct PasswordMessage {
  std::string old_password, new_password;  ///< keys "old", "new"
};

/// Each is an object with exactly these keys, all strings. The error describes what was expected and contains
/// nothing of the text.
Result<LoginMessage> parse_login(std::string_view json);
Result<SetupMessage> parse_setup(std::string_view json);
Result<PasswordMessage> parse_password(std::string_view json);
Result<AccountMessage> parse_account(std::string_view json);

}  // namespace parhelion::station

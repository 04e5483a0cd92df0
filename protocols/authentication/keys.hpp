// Who may publish what on a bus with authentication: the key of this program, and the keys of the senders
// that it listens to.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion {

/// Shared by a sender and by all who verify its messages. Whoever has it can send in the sender's name.
using Secret = std::array<std::uint8_t, 32>;
/// From the kernel's random numbers.
Secret new_secret();

struct Sender {
  std::string name;  ///< 1 to 63 letters, digits, '_', '-', '.'
  Secret secret{};
  std::vector<std::string> roles;     ///< see channels_of_role()
  std::vector<std::string> channels;  ///< further channels, or regular expressions as in LCM
};

struct Keys {
  std::string name;  ///< of this program as a sender
  Secret secret{};
  Duration clock = seconds(1.0);  ///< largest accepted difference between a sender's clock and ours
  std::vector<Sender> senders;    ///< names are unique, and not `name`
};

/// The roles of senders: "robot", "localization", "trainee", "instructor", "server".
const std::vector<std::string>& sender_roles();
/// Canonical channels that a role may publish on, as LCM's regular expressions; nullopt: no such role.
std::optional<std::vector<std::string>> channels_of_role(std::string_view role);

/// Schema keys.schema.json. `origin` names the file in errors, which do not contain secrets.
Result<Keys> parse_keys(const std::string& yaml, const std::string& origin);
/// A regular file that only its owner can read, and no link. Error: which of that it is not, and the remedy.
Result<Keys> load_keys(const std::string& path);
std::string to_yaml(const Keys& keys);

}  // namespace parhelion

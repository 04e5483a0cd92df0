// Accounts and their roles: a JSON file that only its owner can read, written atomically.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/station/http/identity.hpp"

namespace parhelion::station {

/// Error: not 1 to 32 letters, digits, '_', '-' and '.', or the first is not a letter or digit.
Status check_account_name(const std::string& name);

/// Thread-safe. Changes are on the disk when a call returns.
class Accounts {
 public:
  /// A missing file is an empty table. Error: unreadable, not in this format, or readable by others.
  static Result<std::unique_ptr<Accounts>> open(std::filesystem::path file);

  bool empty() const;
  std::vector<Identity> list() const;  ///< by name
  std::optional<Identity> find(const std::string& name) const;
  /// The hash of `name`'s password; empty: no such account.
  std::string hash(const std::string& name) const;

  /// Creates an account, or changes the given fields of one. A new account needs both. The last admin stays
  /// admin.
  Status put(const std::string& name, std::optional<Role> role, std::optional<std::string> hash);
  /// Creates the first account, an admin. Error: an account exists.
  Status put_first(const std::string& name, std::string hash);
  /// Error: no account of this name, or it is the last admin.
  Status remove(const std::string& name);

 private:
  struct Account {
    Role role = Role::observer;
    std::string hash;
  };
  using Table = std::map<std::string, Account>;

  explicit Accounts(std::filesystem::path file) : file_(std::move(file)) {}
  Status load();
  /// Writes `table`, then makes it the current one.
  Status keep(Table table);

  const std::filesystem::path file_;
  mutable std::mutex mutex_;
  Table accounts_;
};

}  // namespace parhelion::station

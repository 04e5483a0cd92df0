// Who may log in: a JSON file that only its owner reads, written whole or not at all.
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

/// Error: not 1 to 32 letters, digits, '_', '-' and '.', the first a letter or digit.
Status check_account_name(const std::string& name);

/// Thread-safe. What a call has changed is on the disk when it returns.
class Accounts {
 public:
  /// A file that is not there holds none. Error: unreadable, not what was written here, or readable by
  /// others.
  static Result<std::unique_ptr<Accounts>> open(std::filesystem::path file);

  bool empty() const;
  std::vector<Identity> list() const;  ///< by name
  std::optional<Identity> find(const std::string& name) const;
  /// The hash of `name`'s password; empty: there is no such account.
  std::string hash(const std::string& name) const;

  /// Makes an account, or changes what is given of one. A new one needs both; the last admin stays admin.
  Status put(const std::string& name, std::optional<Role> role, std::optional<std::string> hash);
  /// Makes the first account, an admin; fails where there is one already.
  Status put_first(const std::string& name, std::string hash);
  /// Error: there is none of this name, or it is the last admin.
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

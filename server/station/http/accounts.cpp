#include "server/station/http/accounts.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/station/http/private_file.hpp"

namespace parhelion::station {
namespace {

bool letter_or_digit(char c) {
  return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

template <class Table>
bool has_admin(const Table& table) {
  return std::any_of(table.begin(), table.end(),
                     [](const auto& entry) { return entry.second.role == Role::admin; });
}

}  // namespace

Status check_account_name(const std::string& name) {
  const bool letters = std::all_of(name.begin(), name.end(), [](char c) {
    return letter_or_digit(c) || c == '_' || c == '-' || c == '.';
  });
  if (name.empty() || name.size() > 32 || !letters || !letter_or_digit(name.front())) {
    return Error{"a name has 1 to 32 letters, digits, '_', '-' and '.', and begins with a letter or digit"};
  }
  return {};
}

Result<std::unique_ptr<Accounts>> Accounts::open(std::filesystem::path file) {
  std::unique_ptr<Accounts> accounts(new Accounts(std::move(file)));
  if (const Status loaded = accounts->load(); !loaded) return loaded.error();
  return accounts;
}

Status Accounts::load() {
  const auto text = read_private_file(file_);
  if (!text) return Error{text.error().message + "; if others could read it, change its passwords"};
  if (!*text) return {};
  const auto json = nlohmann::json::parse(**text, nullptr, false);
  const Error broken{file_.string() +
                     ": not a file of accounts; restore a copy, or remove it to set it up again"};
  if (!json.is_object() || !json.contains("accounts") || !json["accounts"].is_array()) return broken;
  for (const auto& entry : json["accounts"]) {
    if (!entry.is_object()) return broken;
    const auto field = [&entry](const char* key) {
      return entry.contains(key) && entry[key].is_string() ? entry[key].get<std::string>() : "";
    };
    const std::optional<Role> role = role_of(field("role"));
    if (!check_account_name(field("name")) || !role || field("password").empty()) return broken;
    accounts_[field("name")] = {*role, field("password")};
  }
  return {};
}

Status Accounts::keep(Table table) {
  auto entries = nlohmann::json::array();
  for (const auto& [name, account] : table) {
    entries.push_back({{"name", name}, {"role", role_name(account.role)}, {"password", account.hash}});
  }
  const Status written = write_private_file(file_, nlohmann::json{{"accounts", entries}}.dump(1) + "\n");
  if (written) accounts_ = std::move(table);
  return written;
}

bool Accounts::empty() const {
  const std::lock_guard lock(mutex_);
  return accounts_.empty();
}

std::vector<Identity> Accounts::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<Identity> all;
  for (const auto& [name, account] : accounts_) all.push_back({name, account.role});
  return all;
}

std::optional<Identity> Accounts::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto account = accounts_.find(name);
  if (account == accounts_.end()) return std::nullopt;
  return Identity{name, account->second.role};
}

std::string Accounts::hash(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto account = accounts_.find(name);
  return account == accounts_.end() ? "" : account->second.hash;
}

Status Accounts::put(const std::string& name, std::optional<Role> role, std::optional<std::string> hash) {
  if (const Status fine = check_account_name(name); !fine) return fine;
  const std::lock_guard lock(mutex_);
  Table changed = accounts_;
  const auto known = changed.find(name);
  if (known == changed.end() && (!role || !hash)) {
    return Error{"there is no account '" + name + "'; a new one needs a role and a password"};
  }
  Account& account = known == changed.end() ? changed[name] : known->second;
  if (role) account.role = *role;
  if (hash) account.hash = std::move(*hash);
  if (!has_admin(changed)) return Error{"'" + name + "' is the only admin; create another one first"};
  return keep(std::move(changed));
}

Status Accounts::put_first(const std::string& name, std::string hash) {
  if (const Status fine = check_account_name(name); !fine) return fine;
  const std::lock_guard lock(mutex_);
  if (!accounts_.empty()) return Error{"the first account exists already; log in"};
  return keep({{name, {Role::admin, std::move(hash)}}});
}

Status Accounts::remove(const std::string& name) {
  const std::lock_guard lock(mutex_);
  Table changed = accounts_;
  if (changed.erase(name) == 0) return Error{"there is no account '" + name + "'"};
  if (!has_admin(changed)) return Error{"'" + name + "' is the only admin; create another one first"};
  return keep(std::move(changed));
}

}  // namespace parhelion::station

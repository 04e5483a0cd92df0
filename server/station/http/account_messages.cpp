#include "server/station/http/account_messages.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

namespace parhelion::station {
namespace {

constexpr std::size_t kLongestText = 1024;

using Texts = std::map<std::string, std::string>;

/// The string members of an object: all of `wanted`, any of `allowed`.
Result<Texts> parse_texts(std::string_view text, const std::vector<std::string>& wanted,
                          const std::vector<std::string>& allowed = {}) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) return Error{"expected a JSON object"};
  Texts texts;
  for (const auto& [key, value] : json.items()) {
    const bool known =
        std::count(wanted.begin(), wanted.end(), key) + std::count(allowed.begin(), allowed.end(), key) > 0;
    if (!known) return Error{"there is an unknown key"};
    if (!value.is_string()) return Error{key + ": expected text"};
    texts[key] = value.get<std::string>();
    if (texts[key].size() > kLongestText) return Error{key + ": too long"};
  }
  for (const std::string& key : wanted) {
    if (!texts.contains(key)) return Error{key + " is missing"};
  }
  return texts;
}

}  // namespace

Result<LoginMessage> parse_login(std::string_view json) {
  const Result<Texts> texts = parse_texts(json, {"name", "password"});
  if (!texts) return texts.error();
  return LoginMessage{texts->at("name"), texts->at("password")};
}

Result<SetupMessage> parse_setup(std::string_view json) {
  const Result<Texts> texts = parse_texts(json, {"token", "name", "password"});
  if (!texts) return texts.error();
  return SetupMessage{texts->at("token"), texts->at("name"), texts->at("password")};
}

Result<PasswordMessage> parse_password(std::string_view json) {
  const Result<Texts> texts = parse_texts(json, {"old", "new"});
  if (!texts) return texts.error();
  return PasswordMessage{texts->at("old"), texts->at("new")};
}

Result<AccountMessage> parse_account(std::string_view json) {
  const Result<Texts> texts = parse_texts(json, {"name"}, {"role", "password"});
  if (!texts) return texts.error();
  AccountMessage message{texts->at("name"), std::nullopt, std::nullopt};
  if (texts->contains("role")) {
    message.role = role_of(texts->at("role"));
    if (!message.role) return Error{"role: expected observer, trainee, instructor or admin"};
  }
  if (texts->contains("password")) message.password = texts->at("password");
  return message;
}

}  // namespace parhelion::station

// What our own code reads of requests: targets, cookies, queries, hosts, and messages about accounts.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "server/station/http/account_messages.hpp"
#include "server/station/http/accounts.hpp"
#include "server/station/http/http_message.hpp"
#include "server/station/http/request_checks.hpp"

namespace {

void check(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace parhelion;
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  if (const auto target = station::parse_target(text)) {
    check(target->path.front() == '/' && target->path.find("..") == std::string::npos);
    check(target->path.find('\n') == std::string::npos && target->path.find('\0') == std::string::npos);
    (void)station::query_value(target->query, "robot");
  }
  (void)station::cookie_value(text, "a");
  (void)station::network_of(std::string(text));
  static const station::HostNames names({"base.example"});
  if (names.knows(text)) check(!station::host_name(text).empty());
  if (const auto login = station::parse_login(text))
    check(login->name.size() <= 1024 && login->password.size() <= 1024);
  (void)station::parse_setup(text);
  if (const auto account = station::parse_account(text);
      account && station::check_account_name(account->name)) {
    check(account->name.find_first_of("<>&\"'/\\ \n") == std::string::npos);
  }
  check(station::json_text(text).find('\n') == std::string::npos);
  return 0;
}

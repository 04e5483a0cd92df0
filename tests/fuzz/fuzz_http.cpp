// What our own code reads of requests: targets, cookies, queries, hosts, and messages about accounts.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "server/hmi/http/account_messages.hpp"
#include "server/hmi/http/accounts.hpp"
#include "server/hmi/http/http_message.hpp"
#include "server/hmi/http/request_checks.hpp"

namespace {

void check(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace parhelion;
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  if (const auto target = parse_target(text)) {
    check(target->path.front() == '/' && target->path.find("..") == std::string::npos);
    check(target->path.find('\n') == std::string::npos && target->path.find('\0') == std::string::npos);
    (void)query_value(target->query, "robot");
  }
  (void)cookie_value(text, "a");
  (void)network_of(std::string(text));
  static const HostNames names({"base.example"});
  if (names.knows(text)) check(!host_name(text).empty());
  if (const auto login = parse_login(text))
    check(login->name.size() <= 1024 && login->password.size() <= 1024);
  (void)parse_setup(text);
  if (const auto account = parse_account(text); account && check_account_name(account->name)) {
    check(account->name.find_first_of("<>&\"'/\\ \n") == std::string::npos);
  }
  check(json_text(text).find('\n') == std::string::npos);
  return 0;
}

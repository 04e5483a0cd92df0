#include "tools/service/service_checks.hpp"

#include <arpa/inet.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <optional>
#include <string_view>

#include "protocols/bus/multicast_group.hpp"

namespace parhelion::tools {
namespace {

namespace fs = std::filesystem;
using Verdict = MachineCheck::Verdict;

constexpr const char* kUser = "parhelion";
constexpr int kNeededPriority = 10;

/// The value of the last line "<key>=<value>"; nullopt: there is none.
std::optional<std::string> setting(const fs::path& path, std::string_view key) {
  std::ifstream file(path);
  std::optional<std::string> value;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key) && line[key.size()] == '=') value = line.substr(key.size() + 1);
  }
  return value;
}

/// The one that systemd uses; empty: none.
fs::path unit_file(const fs::path& root) {
  std::error_code error;
  for (const char* folder : {"etc/systemd/system", "usr/lib/systemd/system", "lib/systemd/system"}) {
    const fs::path path = root / folder / "parhelion.service";
    if (fs::is_regular_file(path, error)) return path;
  }
  return {};
}

/// What `systemctl edit` wrote, in the order in which systemd reads it.
std::vector<fs::path> drop_ins(const fs::path& root) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root / "etc/systemd/system/parhelion.service.d", error)) {
    if (entry.path().extension() == ".conf") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

MachineCheck check_user(const passwd* user) {
  const char* name = "service's user";
  if (user != nullptr) return {name, Verdict::ok, std::string(kUser) + " is there", ""};
  return {name, Verdict::fail, std::string("no user ") + kUser, "systemd-sysusers parhelion.conf"};
}

MachineCheck check_priority(const fs::path& root, const fs::path& unit) {
  const char* name = "service's priority";
  std::string text = setting(unit, "LimitRTPRIO").value_or("");
  for (const fs::path& path : drop_ins(root)) text = setting(path, "LimitRTPRIO").value_or(text);
  int limit = 0;
  (void)std::from_chars(text.data(), text.data() + text.size(), limit);
  if (text == "infinity" || limit >= kNeededPriority)
    return {name, Verdict::ok, "LimitRTPRIO=" + text + " permits real-time priority", ""};
  return {name, Verdict::warn, unit.string() + " does not permit real-time priority",
          "systemctl edit parhelion: [Service], LimitRTPRIO=" + std::to_string(kNeededPriority)};
}

MachineCheck check_state_folder(const fs::path& folder, const passwd* user) {
  const char* name = "service's folder";
  struct stat found {};
  if (stat(folder.c_str(), &found) != 0) {
    if (errno == ENOENT) return {name, Verdict::ok, folder.string() + " is made when the service starts", ""};
    return {name, Verdict::fail, folder.string() + ": " + std::strerror(errno), "run it as root"};
  }
  if (user != nullptr && found.st_uid != user->pw_uid)
    return {name, Verdict::fail, folder.string() + " does not belong to " + kUser,
            std::string("chown -R ") + kUser + ": " + folder.string()};
  char mode[16];
  std::snprintf(mode, sizeof mode, "%04o", found.st_mode & 07777U);
  if ((found.st_mode & 077U) != 0)
    return {name, Verdict::warn,
            folder.string() + " has mode " + mode + ": other users may read accounts and sessions",
            "chmod 700 " + folder.string()};
  return {name, Verdict::ok, folder.string() + " has mode " + mode, ""};
}

/// The address of this machine from which datagrams to the group are sent. Error: there is no route.
Result<std::string> sender_address(const MulticastGroup& group) {
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = group.address;
  address.sin_port = htons(group.port);
  socklen_t size = sizeof address;
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  // A connected datagram socket sends nothing, but the kernel has chosen its route.
  const bool routed = descriptor >= 0 && connect(descriptor, generic, size) == 0 &&
                      getsockname(descriptor, generic, &size) == 0;
  const int refusal = errno;
  if (descriptor >= 0) close(descriptor);
  if (!routed) return Error{std::strerror(refusal)};
  char text[INET_ADDRSTRLEN] = "";
  (void)inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
  return std::string(text);
}

}  // namespace

std::vector<MachineCheck> check_service(const fs::path& root) {
  const fs::path unit = unit_file(root);
  if (unit.empty()) return {{"service", Verdict::ok, "none is installed: the server is started by hand", ""}};
  const passwd* user = getpwnam(kUser);
  return {{"service", Verdict::ok, unit.string(), ""},
          check_user(user),
          check_priority(root, unit),
          check_state_folder(root / "var/lib/parhelion", user)};
}

MachineCheck check_bus_reach(const std::string& url) {
  const char* name = "reach of the bus";
  const auto group = parse_lcm_url(chosen_lcm_url(url));
  if (!group) return {name, Verdict::fail, group.error().message, "correct the URL"};
  if (group->this_machine_only)
    return {name, Verdict::ok, "this machine only (ttl=0); for a robot on the network: ttl=1", ""};
  const auto sender = sender_address(*group);
  const std::string remedy = "ip route replace 224.0.0.0/4 dev INTERFACE, the one to the robot";
  if (!sender)
    return {name, Verdict::fail, "no multicast route leaves this machine: " + sender.error().message, remedy};
  if (sender->starts_with("127."))
    return {name, Verdict::warn, "the multicast route leads to this machine itself", remedy};
  return {name, Verdict::ok,
          "messages leave this machine from " + *sender + "; everybody there can send, too", ""};
}

std::string service_url(const fs::path& root) {
  return setting(root / "etc/parhelion/parhelion.env", "LCM_DEFAULT_URL").value_or("");
}

}  // namespace parhelion::tools

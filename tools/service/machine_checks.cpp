#include "tools/service/machine_checks.hpp"

#include <sched.h>
#include <sys/statvfs.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "protocols/bus/bus.hpp"
#include "protocols/share.hpp"
#include "server/runtime/thread_priority.hpp"

namespace parhelion::tools {
namespace {

using Verdict = MachineCheck::Verdict;
constexpr std::int64_t kNeededReceiveBuffer = 4'194'304;

std::string gigabytes(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f GB", bytes * 1e-9);
  return text;
}

}  // namespace

MachineCheck check_multicast(const std::string& url) {
  const auto bus = open_network_bus(url);
  if (bus) return {"multicast route", Verdict::ok, "LCM's own message was received", ""};
  const std::string& message = bus.error().message;
  const auto remedy = message.find("; ");
  return {"multicast route", Verdict::fail, message.substr(0, remedy),
          remedy == std::string::npos ? "" : message.substr(remedy + 2)};
}

MachineCheck check_big_messages(const std::string& url) {
  constexpr int sent = 30;
  const char* name = "big messages";
  auto bus = open_network_bus(url);
  if (!bus) return {name, Verdict::fail, "not tried: no bus", "see multicast route"};
  const std::string channel = "PARHELION_DOCTOR";
  if (const Status status = (*bus)->subscribe(channel, sent); !status) {
    return {name, Verdict::fail, status.error().message, ""};
  }
  const std::vector<std::uint8_t> payload(300'000, 0x5A);
  // At the rate of a camera: a burst would only measure the speed of this loop.
  int came = 0;
  Message message;
  for (int i = 0; i < sent; ++i) {
    if (const Status status = (*bus)->publish(channel, payload); !status) {
      return {name, Verdict::fail, status.error().message, ""};
    }
    const auto received = (*bus)->receive(message, milliseconds(200));
    came += received && *received && message.payload == payload;
  }
  const std::string finding =
      std::to_string(came) + " of " + std::to_string(sent) + " of 300 kB were received";
  if (came == sent) return {name, Verdict::ok, finding, ""};
  return {name, came == 0 ? Verdict::fail : Verdict::warn, finding,
          "see receive buffer; camera images would be lost"};
}

MachineCheck check_receive_buffer(const std::filesystem::path& rmem_max) {
  const char* name = "receive buffer";
  std::int64_t bytes = 0;
  if (!(std::ifstream(rmem_max) >> bytes)) {
    return {name, Verdict::warn, rmem_max.string() + " cannot be read",
            "expected a number there; is this Linux with /proc?"};
  }
  const std::string finding = "net.core.rmem_max is " + std::to_string(bytes);
  if (bytes >= kNeededReceiveBuffer) return {name, Verdict::ok, finding, ""};
  return {
      name, Verdict::warn, finding + ", camera images need " + std::to_string(kNeededReceiveBuffer),
      "cp " + share_path("tools/sysctl.d/60-parhelion.conf").string() + " /etc/sysctl.d/ && sysctl --system"};
}

MachineCheck check_disk(const std::filesystem::path& folder) {
  struct statvfs found {};
  if (statvfs(folder.c_str(), &found) != 0) {
    return {"disk", Verdict::fail, folder.string() + ": " + std::strerror(errno),
            "run it in a writable folder"};
  }
  const double free = static_cast<double>(found.f_bavail) * static_cast<double>(found.f_frsize);
  const std::string finding = gigabytes(free) + " free in " + folder.string();
  if (free < 1e9)
    return {"disk", Verdict::fail, finding, "free some space: a session with video writes 2 MB a second"};
  if (free < 10e9) return {"disk", Verdict::warn, finding, "an hour of session with video takes about 8 GB"};
  return {"disk", Verdict::ok, finding, ""};
}

MachineCheck check_processors() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  const int count = sched_getaffinity(0, sizeof allowed, &allowed) == 0 ? CPU_COUNT(&allowed) : 1;
  const std::string finding = std::to_string(count) + (count == 1 ? " processor" : " processors");
  if (count >= 2) return {"processors", Verdict::ok, finding, ""};
  return {"processors", Verdict::warn, finding, "scans in time beside video need two"};
}

MachineCheck check_real_time() {
  const runtime::RealTimeScope scope(runtime::RealTime::on);
  if (scope.holds()) return {"real-time", Verdict::ok, "scans have priority over other programs", ""};
  return {"real-time", Verdict::warn, "scans have normal priority, which delays them on few cores",
          runtime::RealTimeScope::remedy()};
}

MachineCheck check_recording(const std::filesystem::path& rawlog) {
  std::error_code error;
  if (std::filesystem::is_regular_file(rawlog, error))
    return {"recording for demo", Verdict::ok, rawlog.string(), ""};
  return {"recording for demo", Verdict::warn, rawlog.string() + " is missing",
          "apt-get install mrpt-common; only `parhelion demo` needs it"};
}

MachineCheck check_shipped_files() {
  const auto preset = share_path("fusion/scan/presets/lms-200.yaml");
  std::error_code error;
  if (std::filesystem::is_regular_file(preset, error))
    return {"shipped files", Verdict::ok, preset.string(), ""};
  return {"shipped files", Verdict::fail, preset.string() + " is missing",
          "install again, or set PARHELION_SHARE to where share/parhelion is"};
}

}  // namespace parhelion::tools

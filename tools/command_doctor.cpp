// `parhelion doctor`: checks the machine, with a remedy for each fault.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "tools/command.hpp"
#include "tools/service/machine_checks.hpp"
#include "tools/service/service_checks.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kSenaRawlog =
    "/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog";

const char* verdict_text(MachineCheck::Verdict verdict) {
  switch (verdict) {
    case MachineCheck::Verdict::ok:
      return "ok";
    case MachineCheck::Verdict::warn:
      return "warn";
    case MachineCheck::Verdict::fail:
      return "FAIL";
  }
  return "FAIL";
}

/// Without an option or a variable, the bus of the service.
std::string url_to_check(const std::string& given) {
  return given.empty() && std::getenv("LCM_DEFAULT_URL") == nullptr ? service_url("/") : given;
}

Exit examine(const std::string& given_url, const std::string& folder) {
  const std::string url = url_to_check(given_url);
  std::vector<MachineCheck> checks{
      check_multicast(url),        check_bus_reach(url), check_receive_buffer("/proc/sys/net/core/rmem_max"),
      check_big_messages(url),     check_egl(),          check_processors(),
      check_real_time(),           check_disk(folder),   check_shipped_files(),
      check_recording(kSenaRawlog)};
  for (MachineCheck& check : check_service("/")) checks.push_back(std::move(check));
  Exit exit = Exit::done;
  for (const MachineCheck& check : checks) {
    std::printf("%-5s %-20s %s%s%s\n", verdict_text(check.verdict), check.name.c_str(), check.finding.c_str(),
                check.remedy.empty() ? "" : "; do: ", check.remedy.c_str());
    if (check.verdict == MachineCheck::Verdict::fail) exit = Exit::failed;
  }
  return exit;
}

}  // namespace

void add_doctor(CLI::App& app, Exit& exit) {
  struct Arguments {
    std::string url;
    std::string folder = ".";
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("doctor", "Check this machine: network, graphics, disk, recordings, service");
  command->footer("Example:\n  parhelion doctor\n\nExit code 1 if something essential is missing (FAIL).");
  command->add_option("--url", arguments->url,
                      "LCM url ($LCM_DEFAULT_URL, else the service's, else this machine only)");
  command->add_option("--folder", arguments->folder, "Folder for sessions")->capture_default_str();
  command->callback([arguments, &exit] { exit = examine(arguments->url, arguments->folder); });
}

}  // namespace parhelion::tools
